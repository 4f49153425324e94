// Reading off charts: values under the pointer or by the arrow keys, and one cursor over all charts of the same axis. The
// values are those of the table below each chart.
{
  const charts = [...document.querySelectorAll(".chart")].map(box => {
    const svg = box.querySelector("svg"), rows = [...box.querySelectorAll("tbody tr")];
    const [from, to, left, right] = ["from", "to", "left", "right"].map(name => parseFloat(svg.dataset[name]));
    const outputs = [...box.querySelectorAll(".key span output")], at = box.querySelector(".at");
    return { over: box.dataset.over, svg, rows, from, to, left, right, outputs, at,
      row: null, cursor: svg.querySelector(".cursor"), places: rows.map(row => parseFloat(row.cells[0].textContent)) };
  });

  const nearest = (places, wanted) =>
    places.reduce((best, place, i) => Math.abs(place - wanted) < Math.abs(places[best] - wanted) ? i : best, 0);

  const show = (over, wanted) => charts.filter(chart => chart.over === over).forEach(chart => {
    chart.row = wanted === null ? null : nearest(chart.places, wanted);
    const row = chart.row === null ? null : chart.rows[chart.row];
    chart.cursor.setAttribute("visibility", row ? "visible" : "hidden");
    chart.outputs.forEach((output, i) => output.textContent = row ? row.cells[i + 1].textContent : "");
    chart.at.textContent = row ? `${row.cells[0].textContent} ${/\((.*)\)/.exec(over)?.[1] ?? ""}` : "";
    if (row) {
      const share = (chart.places[chart.row] - chart.from) / (chart.to - chart.from);
      chart.cursor.setAttribute("transform", `translate(${chart.left + share * (chart.right - chart.left)} 0)`);
    }
  });

  // Every chart of time, and the skeleton that plays, are at the same moment.
  const timed = [...new Set(charts.map(chart => chart.over).filter(over => over.startsWith("time")))];
  document.addEventListener("moment", event => timed.forEach(over => show(over, event.detail)));
  const point = (over, wanted) => timed.includes(over)
    ? document.dispatchEvent(new CustomEvent("moment", { detail: wanted })) : show(over, wanted);

  const place = (chart, event) => {
    const box = chart.svg.getBoundingClientRect(), x = (event.clientX - box.left) / box.width * chart.svg.viewBox.baseVal.width;
    const share = Math.min(Math.max((x - chart.left) / (chart.right - chart.left), 0), 1);
    return chart.from + share * (chart.to - chart.from);
  };

  for (const chart of charts) {
    chart.svg.addEventListener("pointermove", event => point(chart.over, place(chart, event)));
    chart.svg.addEventListener("pointerleave", () => show(chart.over, null));
    chart.svg.addEventListener("blur", () => show(chart.over, null));
    chart.svg.addEventListener("keydown", event => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      const row = chart.row === null ? 0 : chart.row + step;
      point(chart.over, chart.places[Math.min(Math.max(row, 0), chart.places.length - 1)]);
    });
  }
}
