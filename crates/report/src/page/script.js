"use strict";
// The page is complete without this script. The script sorts tables, moves sliders, hides series and
// shows values. It fetches nothing.

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
    const shown = [[loads.dataset.loadName, load], ["area", area], ["mean gap", gap]];
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

// Hides the series of a legend entry in all panels of its figure, and shows them again.
document.querySelectorAll(".legend li").forEach((entry) => {
  const series = entry.closest("figure").querySelectorAll(`.series[data-entry="${entry.dataset.entry}"]`);
  const toggle = () => {
    const hidden = entry.classList.toggle("off");
    entry.setAttribute("aria-pressed", String(!hidden));
    series.forEach((group) => group.classList.toggle("off", hidden));
  };
  entry.setAttribute("role", "button");
  entry.setAttribute("aria-pressed", "true");
  entry.title = "Click to hide or show";
  entry.tabIndex = 0;
  entry.addEventListener("click", toggle);
  entry.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    toggle();
  });
});

// Shows the values of the point that is nearest to the pointer. The arrow keys go through the points
// of a chart that has the focus.
const tip = document.createElement("div");
tip.className = "tip";
tip.setAttribute("role", "status");
tip.hidden = true;
document.body.append(tip);
// Writes the subscripts of symbols such as h_c, as the drawings have them.
const typeset = (text) => {
  const line = document.createElement("div");
  text.split(/(?<![\p{L}\p{N}_.-])(\p{L}_[\p{L}\p{N}]+)(?![_]|[.-][\p{L}\p{N}])/u).forEach((part, index) => {
    const [symbol, subscript] = index % 2 ? part.split("_") : [part];
    line.append(symbol);
    if (subscript) line.append(Object.assign(document.createElement("sub"), { textContent: subscript }));
  });
  return line;
};
const written = (number) => number.replaceAll("-", "−").replace(/e(−?\d+)/, " · 10^$1");

document.querySelectorAll(".panel svg").forEach((svg) => {
  const chart = svg.querySelector(".chart");
  if (!chart) return;
  const figure = svg.closest("figure");
  const labels = [...figure.querySelectorAll(".legend li")].map((entry) => entry.dataset.label);
  const [left, top, width, height] = chart.dataset.box.split(" ").map(Number);
  const share = (axis) => {
    const [from, to, spacing] = axis.split(" ");
    const place = spacing === "log" ? Math.log : (value) => value;
    const [low, high] = [place(Number(from)), place(Number(to))];
    return (number) => (place(Number(number)) - low) / (high - low);
  };
  const [alongX, alongY] = [share(chart.dataset.x), share(chart.dataset.y)];
  const points = [...chart.querySelectorAll("[data-points]")].flatMap((group) =>
    group.dataset.points.split(" ").map((text) => {
      const values = text.split(",");
      return { group, values, x: left + width * alongX(values[0]), y: top + height * (1 - alongY(values[1])) };
    }));
  points.sort((one, other) => one.x - other.x);
  const ring = document.createElementNS("http://www.w3.org/2000/svg", "circle");
  ring.setAttribute("r", "7");
  ring.setAttribute("class", "ring");
  let shown = null;
  const hide = () => { tip.hidden = true; ring.remove(); shown = null };
  const visible = () => points.filter((point) => !point.group.classList.contains("off"));
  const show = (point) => {
    shown = point;
    const [x, y, lower, upper] = point.values.map(written);
    const lines = [
      labels[point.group.dataset.entry],
      `${chart.dataset.xLabel}: ${x}`,
      `${chart.dataset.yLabel}: ${y}`,
      lower && `${lower} to ${upper}`,
    ].filter(Boolean);
    tip.replaceChildren(...lines.map(typeset));
    ring.setAttribute("cx", point.x);
    ring.setAttribute("cy", point.y);
    chart.append(ring);
    tip.hidden = false;
    const at = ring.getBoundingClientRect();
    const room = document.documentElement.clientWidth - tip.offsetWidth - 8;
    tip.style.left = `${Math.max(4, Math.min(at.right + 8, room))}px`;
    tip.style.top = `${Math.max(4, at.top - tip.offsetHeight - 4)}px`;
  };
  svg.addEventListener("pointermove", (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(chart.getScreenCTM().inverse());
    const distance = (point) => Math.hypot(point.x - at.x, point.y - at.y);
    const nearest = visible().reduce((best, point) => (!best || distance(point) < distance(best) ? point : best), null);
    if (nearest && distance(nearest) < 40) show(nearest);
    else hide();
  });
  svg.addEventListener("pointerleave", hide);
  svg.addEventListener("blur", hide);
  svg.tabIndex = 0;
  svg.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const all = visible();
    const next = all[Math.max(0, Math.min(all.length - 1, all.indexOf(shown) + step))];
    if (next) show(next);
  });
  window.addEventListener("scroll", hide, { passive: true });
});
