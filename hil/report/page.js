"use strict";
/* What a page does by itself: draw its figures, those in view first, take keys, and go to paper.

   A figure is a div of that class with the ID of its data in data-figure; they stand in a
   script element of type application/json. Drawing all at once would keep a long page from opening, and so would the
   library that draws: it stands in the page as text, and is run when the page is there to be read. */
(() => {
  const PRINT_WIDTH_PX = 690; // A4 less its margins, at 96 px to the inch
  const PRINT_HEIGHT = 0.75; // of the height on a screen, of figures that are tall there
  const TALL_PX = 450;
  const ZOOM = 0.25;
  const PAN = 0.1;
  const figures = [...document.querySelectorAll(".plotly-graph-div[data-figure]")];

  function load() {
    const text = document.getElementById("plotly");
    if (window.Plotly || !text) return;
    const script = document.createElement("script");
    script.textContent = text.textContent;
    document.head.append(script); // runs at once
    text.remove();
  }

  function draw(div) {
    if (div.dataset.drawn) return;
    load();
    div.dataset.drawn = "yes";
    const figure = JSON.parse(document.getElementById(div.dataset.figure).textContent);
    screens.set(div, { height: figure.layout.height, legend: figure.layout.legend.y, margin: figure.layout.margin });
    Plotly.newPlot(div, figure.data, figure.layout, figure.config);
    if (printing) Plotly.relayout(div, onPaper(div));
    if (figure.samples) zoomable(div, figure);
    div.addEventListener("keydown", (event) => onKey(div, event));
    reachable(div);
  }

  const DRAWN = 3000; // samples of a line in view beyond which its extremes are drawn
  const GAP = -32768;

  function unpacked(text, Kind) {
    const bytes = Uint8Array.from(atob(text), (each) => each.charCodeAt(0));
    return new Kind(bytes.buffer);
  }

  /* A figure over time that stands on more samples than are drawn: what comes into view is drawn from them. */
  function zoomable(div, figure) {
    const samples = figure.samples;
    const stamps = samples.stamps ? unpacked(samples.stamps, Float64Array) : null;
    const lines = samples.lines.map((line) => ({ ...line, codes: unpacked(line.codes, Int16Array) }));
    const whole = figure.data.map((trace) => ({ x: trace.x, y: trace.y }));
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
    let shown = "";
    function redraw() {
      const range = div._fullLayout.xaxis.range;
      const first = Math.max(0, Math.floor(row(range[0])) - 1);
      const last = Math.min(samples.count - 1, Math.ceil(row(range[1])) + 1);
      const key = first === 0 && last === samples.count - 1 ? "" : `${first} ${last}`;
      if (key === shown || last <= first) return;
      shown = key;
      const drawn = key ? lines.map((line) => inView(line, first, last)) : whole;
      Plotly.restyle(div, { x: drawn.map((each) => each.x), y: drawn.map((each) => each.y) });
    }
    function inView(line, first, last) {
      const length = Math.max(1, Math.floor((2 * (last - first + 1)) / DRAWN));
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
    div.on("plotly_relayout", redraw);
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

  const screens = new Map(); // what each figure is like on a screen
  let printing = false;
  function onPaper(div) {
    const screen = screens.get(div);
    const height = screen.height > TALL_PX ? Math.round(PRINT_HEIGHT * screen.height) : screen.height;
    const around = screen.margin.t + screen.margin.b;
    div.style.height = `${height}px`;
    // Plotly takes the legend's place as a fraction of the height between the margins: keep its distance in pixels.
    const y = (screen.legend * (screen.height - around)) / (height - around);
    return { width: PRINT_WIDTH_PX, height, "legend.y": y };
  }
  function onScreen(div) {
    const screen = screens.get(div);
    div.style.height = `${screen.height}px`;
    return { width: null, height: screen.height, "legend.y": screen.legend, autosize: true };
  }
  function resize(size) {
    for (const div of figures) if (div.dataset.drawn) Plotly.relayout(div, size(div));
  }
  window.addEventListener("beforeprint", () => {
    printing = true;
    document.querySelectorAll("details").forEach((each) => each.setAttribute("open", ""));
    resize(onPaper);
    figures.forEach(draw);
  });
  window.addEventListener("afterprint", () => {
    printing = false;
    resize(onScreen);
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
    setTimeout(() => {
      figures.forEach((div) => watcher.observe(div));
      drawRest();
    }, 100);
  });
  window.addEventListener("resize", scrollable);
  scrollable();
})();
