(() => {
  const table = document.getElementById("scenes");
  const body = table.tBodies[0];
  const viewer = document.getElementById("viewer");
  const large = document.getElementById("large");
  const views = Array.from(document.querySelectorAll("#views button"));
  const element = (id) => document.getElementById(id);
  let row;

  const setView = (view) => {
    table.classList.toggle("grid", view === "grid");
    views.forEach((button) => button.setAttribute("aria-pressed", String(button.dataset.view === view)));
    // A browser may refuse to keep anything for pages that are opened as files.
    try { sessionStorage.setItem("view", view); } catch { /* the next page begins with the grid */ }
  };
  const lastView = () => {
    try { return sessionStorage.getItem("view"); } catch { return null; }
  };

  // The rows with a large picture that the filter shows, in the order of the table.
  const shownRows = () => Array.from(body.rows).filter((other) => !other.hidden && other.dataset.large);

  const showRow = (next) => {
    row = next;
    const name = row.querySelector(".name");
    const live = row.querySelector(".live");
    large.src = row.dataset.large;
    large.alt = row.querySelector("img").alt;
    element("viewer-name").textContent = name.textContent;
    element("viewer-page").href = name.href;
    element("viewer-live").hidden = !live || live.hidden;
    if (live) element("viewer-live").href = live.href;
    const values = Array.from(row.querySelectorAll("td[data-heading]"), (cell) => `${cell.dataset.heading} ${cell.textContent}`);
    element("caption").textContent = values.join(", ");
    const rows = shownRows();
    element("previous").disabled = rows.indexOf(row) <= 0;
    element("next").disabled = rows.indexOf(row) === rows.length - 1;
  };

  const step = (by) => {
    const rows = shownRows();
    const next = rows[rows.indexOf(row) + by];
    if (next) showRow(next);
  };

  body.addEventListener("click", (event) => {
    const link = event.target.closest("a[data-view]");
    const next = link?.closest("tr");
    if (!next?.dataset.large || event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    showRow(next);
    viewer.showModal();
  });
  viewer.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by && !event.ctrlKey && !event.altKey && !event.metaKey) step(by);
  });
  // A click beside the window closes it.
  viewer.addEventListener("click", (event) => {
    if (event.target === viewer && event.detail > 0) {
      const box = viewer.getBoundingClientRect();
      const inside = event.clientX >= box.left && event.clientX <= box.right &&
        event.clientY >= box.top && event.clientY <= box.bottom;
      if (!inside) viewer.close();
    }
  });
  viewer.addEventListener("close", () => row?.querySelector("a[data-view]")?.focus());
  element("previous").addEventListener("click", () => step(-1));
  element("next").addEventListener("click", () => step(1));
  element("close").addEventListener("click", () => viewer.close());
  views.forEach((button) => button.addEventListener("click", () => setView(button.dataset.view)));
  setView(lastView() === "list" ? "list" : "grid");

  const note = element("live-note");
  if (note && location.protocol === "file:") {
    note.hidden = false;
    document.querySelectorAll(".live").forEach((link) => { link.hidden = true; });
  }
})();
