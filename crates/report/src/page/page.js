"use strict";
// Sorts a table by the column whose heading is clicked: numbers by size, texts alphabetically, and
// unknown values last.
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

// Shows the map of a surface at the load of its slider, with load, area and mean gap. Without
// scripts the slider stays hidden, and only the figure above it is visible.
document.querySelectorAll(".loads").forEach((loads) => {
  const maps = [...loads.querySelectorAll("img")];
  const slider = loads.querySelector("input");
  const output = loads.querySelector("output");
  const show = () => {
    const step = Number(slider.value);
    maps.forEach((map, index) => { map.hidden = index !== step });
    const { load, area, gap } = maps[step].dataset;
    const shown = [["load y", load], ["area", area], ["mean gap", gap]];
    output.replaceChildren(...shown.flat().map((text) => {
      const part = document.createElement("span");
      part.textContent = text;
      return part;
    }));
    slider.setAttribute("aria-valuetext", shown.map((pair) => pair.join(" ")).join(", "));
  };
  slider.addEventListener("input", show);
  loads.hidden = false;
  show();
});
