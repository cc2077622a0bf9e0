"use strict";
(() => {
  const table = document.getElementById("scenes");
  const body = table.tBodies[0];
  const rows = Array.from(body.rows);
  const heads = Array.from(table.tHead.rows[0].cells);
  const filter = document.getElementById("filter");
  const order = document.getElementById("order");
  const shown = document.getElementById("shown");
  const chosen = new Set();
  const texts = new Map(rows.map((row) => [row, `${row.textContent} ${row.dataset.words ?? ""}`.toLowerCase()]));

  const show = () => {
    const words = filter.value.toLowerCase().split(/\s+/).filter((word) => word);
    let count = 0;
    for (const row of rows) {
      const labels = row.dataset.labels.split(" ");
      const fits = words.every((word) => texts.get(row).includes(word)) &&
        (chosen.size === 0 || labels.some((label) => chosen.has(label)));
      row.hidden = !fits;
      count += fits ? 1 : 0;
    }
    shown.textContent = `${count} of ${rows.length} shown`;
  };

  const sort = (column, down) => {
    const numeric = heads[column].classList.contains("number");
    const value = (row) => row.cells[column].dataset.value;
    // A row without a value is first in either direction.
    const number = (text) => (text === "" ? (down ? 1 : -1) * Infinity : Number(text));
    const ranked = (a, b) => (a < b ? -1 : a > b ? 1 : 0);
    const compare = numeric
      ? (a, b) => ranked(number(value(a)), number(value(b)))
      : (a, b) => value(a).localeCompare(value(b), undefined, { numeric: true });
    rows.sort((a, b) => (down ? compare(b, a) : compare(a, b)));
    body.append(...rows);
    heads.forEach((head, i) => {
      if (i === column) head.setAttribute("aria-sort", down ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    order.value = `${column} ${down}`;
  };

  heads.forEach((head, column) => {
    if (column === 0) return;
    const numeric = head.classList.contains("number");
    // Of a measure, the worst values are first at first.
    const worst = head.dataset.worst;
    const initial = worst ? worst === "largest" : numeric;
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = head.textContent;
    button.addEventListener("click", () => {
      const before = head.getAttribute("aria-sort");
      sort(column, before ? before === "ascending" : initial);
    });
    for (const down of [initial, !initial]) {
      const way = worst
        ? (down === initial ? "worst first" : "best first")
        : numeric ? (down ? "largest first" : "smallest first") : (down ? "Z to A" : "A to Z");
      const name = head.textContent === "Modified" ? (down ? "latest first" : "earliest first") : way;
      order.append(new Option(`${head.textContent}, ${name}`, `${column} ${down}`));
    }
    head.replaceChildren(button);
  });
  order.addEventListener("change", () => {
    const [column, down] = order.value.split(" ");
    sort(Number(column), down === "true");
  });

  for (const item of document.querySelectorAll("#labels > li")) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = item.className;
    button.textContent = item.textContent;
    button.setAttribute("aria-pressed", "false");
    button.addEventListener("click", () => {
      const label = item.dataset.label;
      if (!chosen.delete(label)) chosen.add(label);
      button.setAttribute("aria-pressed", String(chosen.has(label)));
      show();
    });
    item.className = "";
    item.replaceChildren(button);
  }
  filter.addEventListener("input", show);
  document.getElementById("controls").hidden = false;
  const [column, down] = (table.dataset.sort ?? "1 false").split(" ");
  sort(Number(column), down === "true");
  show();
})();
