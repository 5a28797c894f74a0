"use strict";
/* What a page does by itself: draw its figures, those in view first, take keys, and go to paper.

   A figure is a div of that class with the ID of its data in data-figure; data and the library that draws stand in the
   page as packed text, unpacked when the page is there to be read: drawing all at once would keep it from opening. */
(() => {
  const PRINT_WIDTH_PX = 690; // A4 less its margins, at 96 px to the inch
  const PRINT_HEIGHT = 0.75; // of the height on a screen, of figures that are tall there
  const TALL_PX = 450;
  const ZOOM = 0.25;
  const PAN = 0.1;
  const figures = [...document.querySelectorAll(".plotly-graph-div[data-figure]")];
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const contents = new Map(); // what each figure holds
  const zooms = new Map(); // what draws the samples in view of each that stands on more than are drawn
  let printing = false;

  /* What stands in the page packed: gzip in base64. */
  async function unpackedText(id) {
    const element = document.getElementById(id);
    const bytes = Uint8Array.from(atob(element.textContent), (each) => each.charCodeAt(0));
    element.remove();
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  async function load() {
    for (const div of figures) {
      const figure = JSON.parse(await unpackedText(div.dataset.figure));
      if (figure.samples) {
        figure.zoom = reader(figure.samples);
        figure.zoom.drawn(0, figure.zoom.last).forEach((line, i) => Object.assign(figure.data[i], line));
      }
      contents.set(div, figure);
    }
    const script = document.createElement("script");
    script.textContent = await unpackedText("plotly");
    document.head.append(script); // runs at once
  }

  /* Colours of the light look, and what stands for them on a dark ground. */
  const ON_DARK = {
    "#111111": "#e8eaed", "#666666": "#a9b2bc", "#777777": "#9aa4af", "#b4bac1": "#66717d", "#7c8590": "#8d97a2",
    "#c5ccd4": "#4a545f", "#5a6470": "#a9b2bc", "#0072b2": "#4fb0ea", "#d55e00": "#ff8a3c", "#332288": "#9d8ff2",
    "#882255": "#e0739f", "#009e73": "#2cc596",
  };

  function recoloured(value) {
    if (typeof value === "string") return ON_DARK[value] || value;
    if (Array.isArray(value)) return value.map(recoloured);
    if (value === null || typeof value !== "object" || "bdata" in value) return value;
    return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, recoloured(each)]));
  }

  function look(isDark) {
    const [ink, grid, ground] = isDark ? ["#d5dae0", "#363e47", "#20262d"] : ["#2a3038", "#e6eaef", "#ffffff"];
    const axis = { gridcolor: grid, linecolor: grid, zerolinecolor: grid, automargin: true, title: { standoff: 12 } };
    const clear = "rgba(0,0,0,0)";
    const menu = { bgcolor: ground, bordercolor: grid };
    const hoverlabel = { bgcolor: ground, bordercolor: grid };
    const layout = { font: { color: ink }, paper_bgcolor: clear, plot_bgcolor: clear, xaxis: axis, yaxis: axis };
    return { layout: { ...layout, hoverlabel, updatemenudefaults: menu, modebar: { color: "#8a929b" } } };
  }

  function specification(div) {
    const { data, layout, config } = contents.get(div);
    const isDark = dark.matches && !printing;
    const size = printing ? onPaper(div) : { width: undefined, height: layout.height, autosize: true };
    div.style.height = `${size.height}px`;
    const coloured = isDark ? recoloured({ data, layout }) : structuredClone({ data, layout });
    const legend = { ...coloured.layout.legend, ...size.legend };
    const shown = { ...coloured.layout, ...size, legend, template: look(isDark), uirevision: "kept" };
    return [coloured.data, shown, config];
  }

  function draw(div) {
    if (div.dataset.drawn || !window.Plotly) return;
    div.dataset.drawn = "yes";
    Plotly.newPlot(div, ...specification(div));
    if (contents.get(div).zoom) zoomable(div, contents.get(div).zoom);
    document.querySelectorAll("[data-cut]").forEach((box) => box.dataset.cut === div.id && cutting(div, box));
    div.addEventListener("keydown", (event) => onKey(div, event));
    reachable(div);
  }

  function drawAgain() {
    for (const div of figures) {
      if (!div.dataset.drawn) continue;
      Plotly.react(div, ...specification(div));
      if (zooms.has(div)) zooms.get(div)();
    }
  }
  dark.addEventListener("change", drawAgain);

  const DRAWN = 3000; // samples of a line in view beyond which its extremes are drawn
  const GAP = -32768;

  function numbers(text, Kind) {
    const bytes = Uint8Array.from(atob(text), (each) => each.charCodeAt(0));
    return new Kind(bytes.buffer);
  }

  /* The samples of a figure over time: where a moment is among them, and its lines between two of them. */
  function reader(samples) {
    const stamps = samples.stamps ? numbers(samples.stamps, Float64Array) : null;
    const lines = samples.lines.map((line) => ({ ...line, codes: numbers(line.codes, Int16Array) }));
    const time = (i) => (stamps ? stamps[i] : samples.start + i * samples.step);
    const value = (line, i) => (line.codes[i] === GAP ? null : line.offset + line.scale * line.codes[i]);
    const row = (t) => {
      if (!stamps) return (t - samples.start) / samples.step;
      let low = 0;
      for (let high = stamps.length; low < high; ) {
        const middle = (low + high) >> 1;
        if (stamps[middle] < t) low = middle + 1;
        else high = middle;
      }
      return low;
    };
    function inView(line, first, last) {
      const length = Math.max(1, Math.ceil((2 * (last - first + 1)) / DRAWN));
      const x = [];
      const y = [];
      for (let begin = first; begin <= last; begin += length) {
        let low = begin;
        let high = begin;
        for (let i = begin; i < begin + length && i <= last; i++) {
          if (line.codes[i] === GAP) continue;
          if (line.codes[low] === GAP || line.codes[i] < line.codes[low]) low = i;
          if (line.codes[high] === GAP || line.codes[i] > line.codes[high]) high = i;
        }
        for (const i of low === high ? [low] : [Math.min(low, high), Math.max(low, high)]) {
          x.push(time(i));
          y.push(value(line, i));
        }
      }
      return { x, y };
    }
    const drawn = (first, last) => lines.map((line) => inView(line, first, last));
    const last = samples.count - 1;
    return { row, drawn, last, whole: [time(0), time(last)] };
  }

  /* What comes into view of a figure is drawn from its samples. */
  function zoomable(div, { row, drawn, last, whole }) {
    let shown = "";
    function redraw() {
      const range = div._fullLayout.xaxis.range;
      const from = Math.max(0, Math.floor(row(range[0])) - 1);
      const to = Math.min(last, Math.ceil(row(range[1])) + 1);
      const key = from === 0 && to === last ? "" : `${from} ${to}`;
      if (key === shown || to <= from) return;
      shown = key;
      const lines = key ? drawn(from, to) : drawn(0, last);
      Plotly.restyle(div, { x: lines.map((each) => each.x), y: lines.map((each) => each.y) });
    }
    div.on("plotly_relayout", (change) => {
      const all = Object.keys(change).some((key) => /^xaxis\d*\.autorange$/.test(key) && change[key]);
      if (!all) return redraw();
      const names = axes(div).filter((name) => name.startsWith("x")); // what is drawn is a part: it has not the whole range
      Plotly.relayout(div, Object.fromEntries(names.map((name) => [`${name}.range`, whole])));
    });
    zooms.set(div, () => {
      shown = "";
      redraw();
    });
  }

  /* The stretch in view, with those that were kept before it, as lines of [signals]. */
  function cutting(div, box) {
    const [keep, again] = box.querySelectorAll("button");
    const kept = [];
    const inView = () => {
      const range = div._fullLayout.xaxis.range;
      const digits = Math.max(0, 3 - Math.floor(Math.log10(range[1] - range[0])));
      return range.map((each) => each.toFixed(digits));
    };
    const whole = inView().join();
    function show() {
      const [from, to] = inView();
      const chosen = `${[from, to]}` === whole ? kept : [...kept, [from, to]];
      const all = chosen.map((each) => `[${each.join(", ")}]`);
      const lines = kept.length ? `stretches = [${all.join(", ")}]` : `from_s = ${from}\nto_s = ${to}`;
      box.querySelector("pre").textContent = lines;
    }
    keep.addEventListener("click", () => {
      kept.push(inView());
      Plotly.relayout(div, Object.fromEntries(axes(div).map((name) => [`${name}.autorange`, true])));
    });
    again.addEventListener("click", () => {
      kept.length = 0;
      show();
    });
    div.on("plotly_relayout", show);
    show();
  }

  /* Buttons of a figure's own bar, for those without a pointer. */
  function reachable(div) {
    for (const button of div.querySelectorAll(".modebar-btn:not([tabindex])")) {
      button.setAttribute("tabindex", "0");
      button.setAttribute("role", "button");
      button.setAttribute("aria-label", button.dataset.title || "");
      button.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        button.dispatchEvent(new MouseEvent("click", { bubbles: true }));
      });
    }
  }

  function onKey(div, event) {
    if (event.target !== div || event.ctrlKey || event.altKey || event.metaKey) return;
    if (/^[1-9]$/.test(event.key)) {
      toggle(div, Number(event.key) - 1);
    } else if (event.key === "0") {
      Plotly.relayout(div, Object.fromEntries(axes(div).map((name) => [`${name}.autorange`, true])));
    } else if (event.key in MOVES) {
      Plotly.relayout(div, moved(div, ...MOVES[event.key]));
    } else return;
    event.preventDefault();
  }

  const MOVES = {
    "+": [ZOOM, -ZOOM],
    "-": [-ZOOM, ZOOM],
    ArrowLeft: [-PAN, -PAN],
    ArrowRight: [PAN, PAN],
  };

  function axes(div) {
    return Object.keys(div._fullLayout).filter((name) => /^[xy]axis\d*$/.test(name));
  }

  /* Both ends of every abscissa, moved by shares of its range; on a logarithmic one of its decades. */
  function moved(div, low, high) {
    const change = {};
    for (const name of axes(div).filter((each) => each.startsWith("x"))) {
      const [from, to] = div._fullLayout[name].range;
      change[`${name}.range`] = [from + low * (to - from), to + high * (to - from)];
    }
    return change;
  }

  /* Show or hide the n-th entry of the legend with all that belongs to it. */
  function toggle(div, number) {
    const listed = div.data.filter((trace) => trace.showlegend !== false);
    const chosen = listed[number];
    if (!chosen) return;
    const group = chosen.legendgroup || chosen.name;
    const which = div.data.flatMap((trace, i) => ((trace.legendgroup || trace.name) === group ? [i] : []));
    const hidden = chosen.visible === "legendonly";
    Plotly.restyle(div, { visible: hidden ? true : "legendonly" }, which);
  }

  /* What is wider than its place is scrolled by keys only if it can have the focus. */
  function scrollable() {
    for (const box of document.querySelectorAll(".wide")) {
      if (box.scrollWidth > box.clientWidth + 1) box.setAttribute("tabindex", "0");
      else box.removeAttribute("tabindex");
    }
  }

  function onPaper(div) {
    const screen = contents.get(div).layout;
    const height = screen.height > TALL_PX ? Math.round(PRINT_HEIGHT * screen.height) : screen.height;
    const around = screen.margin.t + screen.margin.b;
    // Plotly takes the legend's place as a fraction of the height between the margins: keep its distance in pixels.
    const y = (screen.legend.y * (screen.height - around)) / (height - around);
    return { width: PRINT_WIDTH_PX, height, autosize: false, legend: { y } };
  }
  window.addEventListener("beforeprint", () => {
    printing = true;
    document.querySelectorAll("details").forEach((each) => each.setAttribute("open", ""));
    drawAgain();
    figures.forEach(draw);
  });
  window.addEventListener("afterprint", () => {
    printing = false;
    drawAgain();
  });

  const watcher = new IntersectionObserver(
    (entries) => entries.filter((entry) => entry.isIntersecting).forEach((entry) => draw(entry.target)),
    { rootMargin: "600px" },
  );
  for (const div of figures) {
    const headings = [...document.querySelectorAll("h2, h3")];
    const above = headings.filter((each) => each.compareDocumentPosition(div) & Node.DOCUMENT_POSITION_FOLLOWING).pop();
    if (above) div.setAttribute("aria-label", `figure: ${above.textContent}`);
  }
  function drawRest() {
    const left = figures.find((div) => !div.dataset.drawn);
    if (!left) return;
    draw(left);
    setTimeout(drawRest, 50); // the reader comes first
  }
  window.addEventListener("load", () => {
    if (!figures.length) return;
    setTimeout(async () => {
      await load();
      figures.forEach((div) => watcher.observe(div));
      drawRest();
    }, 100);
  });
  window.addEventListener("resize", scrollable);
  scrollable();
})();
