"use strict";
// Sorts a table by the column whose heading is pressed: numbers by size, words by the alphabet,
// what is not known last.
document.querySelectorAll("th button").forEach((button) => {
  button.addEventListener("click", () => {
    const heading = button.parentElement;
    const column = heading.cellIndex;
    const body = heading.closest("table").tBodies[0];
    const descending = heading.getAttribute("aria-sort") === "ascending";
    const numeric = heading.classList.contains("number");
    const value = (row) => {
      const text = row.cells[column].textContent;
      return numeric ? parseFloat(text) : text === "–" ? "" : text;
    };
    const unknown = (v) => v === "" || Number.isNaN(v);
    const order = (one, other) => {
      const [a, b] = [value(one), value(other)];
      if (unknown(a) || unknown(b)) return unknown(a) - unknown(b);
      const ascending = numeric ? a - b : a.localeCompare(b);
      return descending ? -ascending : ascending;
    };
    const rows = [...body.rows].sort(order);
    heading.parentElement.querySelectorAll("th").forEach((other) => other.removeAttribute("aria-sort"));
    heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
    body.append(...rows);
  });
});

// Shows the map of one surface under the load that its slider stands at, and what is told of it. Without
// a script there is no slider, and the figure above it all the same.
document.querySelectorAll(".loads").forEach((loads) => {
  const maps = [...loads.querySelectorAll("img")];
  const slider = loads.querySelector("input");
  const output = loads.querySelector("output");
  const show = () => {
    const step = Number(slider.value);
    maps.forEach((map, place) => { map.hidden = place !== step });
    const { load, area, gap } = maps[step].dataset;
    const told = [["load y", load], ["area", area], ["mean gap", gap]];
    output.replaceChildren(...told.flat().map((text) => {
      const part = document.createElement("span");
      part.textContent = text;
      return part;
    }));
    slider.setAttribute("aria-valuetext", told.map((pair) => pair.join(" ")).join(", "));
  };
  slider.addEventListener("input", show);
  loads.hidden = false;
  show();
});
