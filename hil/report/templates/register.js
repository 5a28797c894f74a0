"use strict";
/* Tables of many rows: filtered, sorted, and only the rows in view are there. And the courses of one row's values.

   A register is a div with the ID of its packed rows in data-register; choosing a row's first cell shows its courses in
   the div with data-courses, if the page has one. Texts are set as texts: nothing of them becomes markup. */
(() => {
  const ROW_PX = 32; // as in page.css
  const SPARE = 12; // rows above and below those in view
  const SVG = "http://www.w3.org/2000/svg";

  async function unpacked(id) {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (each) => each.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).json();
  }

  function made(kind, parent, text = "", kinds = "") {
    const element = document.createElement(kind);
    element.textContent = text;
    if (kinds) element.className = kinds;
    parent.append(element);
    return element;
  }

  const shown = (value) => (value === null ? "" : typeof value === "number" ? String(+value.toPrecision(4)) : value);
  const names = new Intl.Collator("en", { numeric: true }); // bus_2 before bus_10
  const compared = (a, b) =>
    (a === null) - (b === null) || (typeof a === "string" ? names.compare(a, b) : a < b ? -1 : Number(a > b));

  async function register(box) {
    const { headings, rows, folder, choose } = await unpacked(box.dataset.register);
    const texts = rows.map((row) => row.map(shown).join(" ").toLowerCase());
    const field = box.querySelector("input");
    const count = box.querySelector("output");
    const view = box.querySelector(".rows");
    const table = made("table", view);
    const head = made("tr", made("thead", table));
    const [before, body, after] = [made("tbody", table), made("tbody", table), made("tbody", table)];
    let order = rows.map((_, i) => i);
    let sorted = { column: -1, down: false };
    let first = -1;
    const leads = (column) => folder && column === headings.length - 1;

    function cell(row, column, place) {
      const text = shown(rows[row][column]);
      if (column === 0 && choose) {
        made("button", place, text).addEventListener("click", () => courses(text));
      } else if (leads(column)) {
        if (text) made("a", place, "open").href = `${folder}/${text}.json`;
      } else place.textContent = place.title = text;
    }

    function draw() {
      const begin = Math.max(0, Math.floor(view.scrollTop / ROW_PX) - SPARE);
      const end = Math.min(order.length, begin + Math.ceil(view.clientHeight / ROW_PX) + 2 * SPARE);
      if (begin === first) return;
      first = begin;
      body.replaceChildren();
      for (const row of order.slice(begin, end)) {
        const line = made("tr", body);
        headings.forEach((_, column) => {
          cell(row, column, made("td", line, "", typeof rows[row][column] === "number" ? "number" : ""));
        });
      }
      before.style.height = `${begin * ROW_PX}px`;
      after.style.height = `${(order.length - end) * ROW_PX}px`;
    }

    function arrange() {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      order = texts.flatMap((text, i) => (words.every((word) => text.includes(word)) ? [i] : []));
      const { column, down } = sorted;
      if (column >= 0) order.sort((a, b) => (down ? -1 : 1) * compared(rows[a][column], rows[b][column]));
      count.textContent = `${order.length} of ${rows.length}`;
      view.scrollTop = 0;
      first = -1;
      draw();
    }

    headings.forEach((heading, column) => {
      made("button", made("th", head), heading).addEventListener("click", () => {
        sorted = { column, down: sorted.column === column && !sorted.down };
        arrange();
      });
    });
    field.addEventListener("input", arrange);
    view.addEventListener("scroll", draw);
    arrange();
  }

  let known = null;

  async function courses(name) {
    const box = document.querySelector("[data-courses]");
    if (!box) return;
    known = known || (await unpacked(box.dataset.courses));
    box.replaceChildren();
    made("h3", box, name);
    for (const course of known[name] || []) {
      const figure = made("figure", box);
      made("figcaption", figure, course.said);
      figure.append(drawn(course));
    }
    box.scrollIntoView({ block: "nearest" });
  }

  /* Values with their intervals one after the other, the range that is usual in the fleet, levels before and after. */
  function drawn({ low, value, high, usual, levels, unit, dates }) {
    const [width, height, margin] = [460, 170, 44];
    const all = [...value, ...low, ...high, ...usual].filter((each) => each !== null);
    const [least, most] = [Math.min(...all), Math.max(...all)];
    const x = (i) => margin + ((i + 0.5) * (width - margin)) / value.length;
    const y = (each) => height - 22 - ((each - least) * (height - 34)) / (most - least || 1);
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("role", "img");
    function put(kind, attributes, text = "") {
      const element = document.createElementNS(SVG, kind);
      Object.entries(attributes).forEach(([key, each]) => element.setAttribute(key, each));
      element.textContent = text;
      svg.append(element);
    }
    if (usual.length) {
      put("rect", { class: "usual", x: margin, width: width - margin, y: y(usual[1]), height: y(usual[0]) - y(usual[1]) });
    }
    for (const [from, to, level] of levels) {
      put("line", { class: "level", x1: x(from - 0.5), x2: x(to - 0.5), y1: y(level), y2: y(level) });
    }
    value.forEach((each, i) => {
      if (low[i] !== null && high[i] !== null) {
        put("line", { class: "interval", x1: x(i), x2: x(i), y1: y(low[i]), y2: y(high[i]) });
      }
      put("circle", { cx: x(i), cy: y(each), r: 2.5 });
    });
    put("text", { x: 0, y: y(most) + 4 }, shown(most));
    put("text", { x: 0, y: y(least) + 4 }, `${shown(least)} ${unit}`);
    put("text", { x: margin, y: height - 4 }, dates[0]);
    put("text", { x: width, y: height - 4, "text-anchor": "end" }, dates[1]);
    return svg;
  }

  window.addEventListener("load", () => document.querySelectorAll("[data-register]").forEach(register));
})();
