"use strict";
// Tables of the class "sortable": a heading sorts by its column, the field above filters rows.
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0], rows = [...body.rows];
  const heads = [...table.tHead.rows[0].cells];
  const key = (row, column) => {
    const cell = row.cells[column];
    return cell.dataset.v === undefined ? cell.textContent.trim() : Number(cell.dataset.v);
  };
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = head.textContent;
    head.replaceChildren(button);
    button.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const numeric = head.classList.contains("n");
      const compare = (a, b) => {
        const [x, y] = [key(a, column), key(b, column)];
        if (numeric && typeof x !== typeof y) return typeof x === "number" ? -1 : 1; // dashes last
        const order = numeric ? x - y : x.localeCompare(y, "en", { numeric: true });
        return up ? order : -order;
      };
      body.append(...rows.sort(compare));
    });
  });
  const filter = table.closest(".wide").previousElementSibling;
  if (filter && filter.classList.contains("filter")) {
    const field = filter.querySelector("input"), told = filter.querySelector("[role=status]");
    filter.hidden = false;
    field.addEventListener("input", () => {
      const wanted = field.value.toLowerCase().split(/\s+/);
      let shown = 0;
      for (const row of rows) {
        const text = row.textContent.toLowerCase();
        row.hidden = !wanted.every((word) => text.includes(word));
        shown += row.hidden ? 0 : 1;
      }
      told.textContent = field.value ? `${shown} of ${rows.length}` : "";
    });
  }
}
