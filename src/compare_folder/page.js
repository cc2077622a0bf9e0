(() => {
  const viewer = document.getElementById("viewer");
  const stage = document.getElementById("stage");
  const line = document.getElementById("line");
  const modes = Array.from(document.querySelectorAll("#modes button"));
  const pictures = ["new", "old", "difference"].map((name) => [name, document.getElementById(`shown-${name}`)]);
  const body = document.getElementById("scenes").tBodies[0];
  const BLINK = 600; // The milliseconds for which each picture is shown.
  let row, timer;

  // The rows that can be shown, in the order of the table.
  const shownRows = () => Array.from(body.rows).filter((other) => !other.hidden && other.dataset.new);

  const setLine = (percent) => {
    line.value = String(percent);
    stage.style.setProperty("--line-at", `${line.value}%`);
  };

  const setMode = (mode) => {
    clearInterval(timer);
    stage.dataset.mode = mode;
    stage.dataset.shown = { slider: "new old", blink: "new" }[mode] ?? mode;
    if (mode === "blink") {
      timer = setInterval(() => {
        stage.dataset.shown = stage.dataset.shown === "new" ? "old" : "new";
      }, BLINK);
    }
    document.getElementById("line-label").hidden = mode !== "slider";
    modes.forEach((button) => button.setAttribute("aria-pressed", String(button.dataset.mode === mode)));
  };

  const showPair = (next) => {
    row = next;
    const { width, height, scale } = row.dataset;
    pictures.forEach(([name, image]) => { image.src = row.dataset[name]; });
    stage.style.setProperty("--aspect", String(width / height));
    document.getElementById("viewer-name").textContent = row.querySelector(".name").textContent;
    const values = Array.from(row.querySelectorAll("td[data-heading]"), (cell) => `${cell.dataset.heading} ${cell.textContent}`);
    document.getElementById("caption").textContent =
      `${values.join(", ")}. Difference: from black for none to pale yellow for ${scale} of white.`;
    const rows = shownRows();
    document.getElementById("previous").disabled = rows.indexOf(row) <= 0;
    document.getElementById("next").disabled = rows.indexOf(row) === rows.length - 1;
  };

  const step = (by) => {
    const rows = shownRows();
    const next = rows[rows.indexOf(row) + by];
    if (next) showPair(next);
  };

  const point = (event) => {
    const box = stage.getBoundingClientRect();
    setLine(Math.min(Math.max(100 * (event.clientX - box.left) / box.width, 0), 100));
  };

  body.addEventListener("click", (event) => {
    const link = event.target.closest("a[data-view]");
    if (!link || event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    showPair(link.closest("tr"));
    setLine(50);
    setMode(link.dataset.view === "difference" ? "difference" : "slider");
    viewer.showModal();
  });
  stage.addEventListener("pointerdown", (event) => {
    if (stage.dataset.mode !== "slider") return;
    stage.setPointerCapture(event.pointerId);
    point(event);
  });
  stage.addEventListener("pointermove", (event) => {
    if (stage.hasPointerCapture(event.pointerId)) point(event);
  });
  line.addEventListener("input", () => setLine(line.value));
  modes.forEach((button) => button.addEventListener("click", () => setMode(button.dataset.mode)));
  document.getElementById("previous").addEventListener("click", () => step(-1));
  document.getElementById("next").addEventListener("click", () => step(1));
  document.getElementById("close").addEventListener("click", () => viewer.close());
  viewer.addEventListener("close", () => clearInterval(timer));
})();
