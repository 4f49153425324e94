// A click on a column's heading sorts by it, another one the other way round; what is not known comes last.
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.textContent = head.textContent;
    head.replaceChildren(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending", numbers = head.classList.contains("number");
      heads.forEach(other => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const of = row => row.cells[column].textContent;
      const words = (a, b) => a.localeCompare(b, "en", { numeric: true });
      const compare = numbers ? (a, b) => parseFloat(a) - parseFloat(b) : words;
      const rows = [...body.rows].sort((a, b) =>
        (of(a) === "–") - (of(b) === "–") || (down ? -1 : 1) * (of(a) === "–" ? 0 : compare(of(a), of(b))));
      body.append(...rows);
    });
  });
}
