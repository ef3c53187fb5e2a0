"use strict";
// Sorts the table by a column; without this script, it is sorted by score.
const table = document.querySelector("table");
const heads = table ? [...table.tHead.rows[0].cells] : [];

const valueOf = (row, column) => row.cells[column].dataset.value ?? "";

function sort(column) {
  const head = heads[column];
  const first = head.dataset.first;
  const other = first === "ascending" ? "descending" : "ascending";
  const order = head.getAttribute("aria-sort") === first ? other : first;
  const sign = order === "ascending" ? 1 : -1;
  const isText = "text" in head.dataset;
  const rows = [...table.tBodies[0].rows];
  rows.sort((one, another) => {
    const [a, b] = [valueOf(one, column), valueOf(another, column)];
    if (a === "" || b === "") return (a === "") - (b === ""); // missing values come last, in either order
    return sign * (isText ? a.localeCompare(b) : a - b);
  });
  table.tBodies[0].append(...rows);
  for (const each of heads) each.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", order);
}

heads.forEach((head, column) => {
  const button = document.createElement("button");
  button.type = "button";
  button.append(...head.childNodes);
  button.addEventListener("click", () => sort(column));
  head.append(button);
});
