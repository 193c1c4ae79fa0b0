"use strict";
(() => {
  const charts = JSON.parse(document.getElementById("charts").textContent);
  const figures = [...document.querySelectorAll("figure.chart")];
  const decades = [-4, -3, -2, -1, 0, 1].flatMap((power) => [1, 2, 5].map((step) => Number(`${step}e${power}`)));
  const options = { displaylogo: false, responsive: true, modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]] };
  // Plotly reads some HTML in texts: what comes from a file is to be seen as it is.
  const plain = (text) => String(text).replace(/[&<>"'$]/g, (sign) => `&#${sign.charCodeAt(0)};`);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  const axis = (title, log) => ({
    title: { text: plain(title) }, type: log ? "log" : "linear", gridcolor: colour("--line"), zerolinecolor: colour("--soft"),
    linecolor: colour("--soft"), automargin: true, exponentformat: "power",
  });
  const layout = (chart) => {
    const far = chart.log_y ? { dtick: 2 } : {};
    // Markers would leave room on both sides of a history.
    const ends = chart.lines.flatMap((line) => [line.x[0], line.x[line.x.length - 1]]);
    const span = chart.log_x || !ends.length ? {} : { range: [Math.min(...ends), Math.max(...ends)] };
    return {
      title: { text: plain(chart.title), x: 0.02, xanchor: "left", font: { size: 14 } }, font: { color: colour("--fore"), size: 12 },
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", hovermode: "closest", showlegend: true,
      margin: { l: 60, r: 16, t: 40, b: 50 }, legend: { orientation: "h", y: -0.32, yanchor: "top", maxheight: 0.3 },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("--soft"), activecolor: colour("--link") },
      xaxis: { ...axis(chart.x, chart.log_x), ...span, ...(chart.log_x ? { tickvals: decades, ticktext: decades.map(String) } : {}) },
      yaxis: { ...axis(chart.y, chart.log_y), ...far, ...(chart.log_x ? { rangemode: "tozero" } : {}) },
      shapes: chart.bound === null ? [] : [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: chart.bound, y1: chart.bound,
        line: { color: "#d6453d", dash: "dash", width: 1 }, label: { text: `tolerance ${chart.bound}`, textposition: "start" } }],
    };
  };
  const traces = (chart) => {
    const names = [...new Set(chart.lines.map((line) => line.name))];
    return [...chart.lines].sort((a, b) => b.pale - a.pale).map((line) => {
      const place = names.indexOf(line.name);
      // Raw values beside smooth ones are pale and without dashes; black is no colour of a dark page.
      const raw = line.pale && !chart.log_x;
      const ink = raw ? colour("--soft") : line.colour === "#1a1a1a" ? colour("--fore") : line.colour;
      const marked = line.symbol && !line.pale;
      return {
        x: line.x, y: line.y, name: plain(line.name), type: "scatter", mode: line.dots ? "markers" : marked ? "lines+markers" : "lines",
        legendgroup: String(place), showlegend: !(line.pale && chart.log_x), opacity: line.pale ? 0.4 : 1,
        visible: place < chart.shown ? true : "legendonly", line: { width: 1.3, color: ink, dash: raw ? "solid" : line.dash },
        marker: { size: line.dots ? 3 : 6, color: ink, symbol: line.dots ? "circle" : line.symbol, maxdisplayed: line.dots ? 0 : 8 },
      };
    });
  };
  const draw = (figure) => {
    const chart = charts[figure.dataset.chart];
    return Plotly.newPlot(figure, traces(chart), layout(chart), options);
  };
  const repaint = () => figures.forEach((figure) => {
    const chart = charts[figure.dataset.chart];
    const inks = traces(chart).map((trace) => trace.line.color);
    Plotly.update(figure, { "line.color": inks, "marker.color": inks }, layout(chart));
  });

  const number = (text) => (/^[-+]?[\d.]+(e[-+]?\d+)?$/i.test(text) ? Number(text) : NaN);
  const sort = (head) => {
    const body = head.closest("table").tBodies[0];
    const column = [...head.parentNode.children].indexOf(head);
    const falls = head.getAttribute("aria-sort") !== "descending";
    for (const other of head.parentNode.children) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", falls ? "descending" : "ascending");
    const rows = [...body.rows].map((row) => [row, row.cells[column].textContent.trim()]);
    const numeric = rows.some(([, text]) => !Number.isNaN(number(text)));
    const order = ([, a], [, b]) => {
      if (!numeric) return falls ? b.localeCompare(a) : a.localeCompare(b);
      const [x, y] = [number(a), number(b)];
      if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) - Number.isNaN(y);
      return falls ? y - x : x - y;
    };
    body.append(...rows.sort(order).map(([row]) => row));
  };
  for (const head of document.querySelectorAll("table.sortable th")) head.querySelector("button").addEventListener("click", () => sort(head));

  Promise.all(figures.map(draw)).then(() => document.documentElement.setAttribute("data-drawn", figures.length));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  matchMedia("print").addEventListener("change", repaint);
})();
