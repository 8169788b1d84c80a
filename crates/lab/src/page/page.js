"use strict";
// Without this script the page lacks the sorting and the filters, and nothing else.
(() => {
  const collator = new Intl.Collator("en", { numeric: true, sensitivity: "base" });

  // Figures by their value, not by what is shown of it; then words; missing cells last.
  const key = (cell) => {
    if (!cell || cell.classList.contains("missing")) return { rank: 2 };
    if (cell.dataset.value !== undefined) return { rank: 0, value: Number(cell.dataset.value) };
    return { rank: 1, value: cell.textContent.trim() };
  };
  const compare = (a, b, sign) => {
    if (a.rank !== b.rank) return a.rank - b.rank;
    if (a.rank === 0) return sign * (a.value - b.value);
    return a.rank === 1 ? sign * collator.compare(a.value, b.value) : 0;
  };

  const sortable = (table) => {
    const body = table.tBodies[0];
    const asMade = [...body.rows];
    const heads = [...table.tHead.rows[0].cells];
    // From the order in which the table was made, so that equal rows stay in it, whatever was sorted before.
    const sort = (column, direction) => {
      let rows = asMade;
      if (direction !== "none") {
        const sign = direction === "ascending" ? 1 : -1;
        const keyed = asMade.map((row) => ({ row, key: key(row.cells[column]) }));
        rows = keyed.sort((a, b) => compare(a.key, b.key, sign)).map((k) => k.row);
      }
      const all = document.createDocumentFragment();
      rows.forEach((row) => all.append(row));
      body.append(all);
      heads.forEach((head, k) => head.setAttribute("aria-sort", k === column ? direction : "none"));
    };
    const next = { none: "ascending", ascending: "descending", descending: "none" };
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      button.addEventListener("click", () => sort(column, next[head.getAttribute("aria-sort")]));
      head.append(button);
      head.setAttribute("aria-sort", "none");
    });
  };

  const filterable = (table) => {
    const rows = [...table.tBodies[0].rows];
    const bar = document.createElement("div");
    const label = document.createElement("label");
    const input = document.createElement("input");
    const count = document.createElement("output");
    let texts = null;
    const filter = () => {
      texts ??= rows.map((row) => [...row.cells].map((cell) => cell.textContent).join(" ").toLowerCase());
      const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      rows.forEach((row, k) => {
        row.hidden = !words.every((word) => texts[k].includes(word));
        shown += row.hidden ? 0 : 1;
      });
      count.textContent = words.length ? `${shown} of ${rows.length} rows` : `${rows.length} rows`;
    };
    bar.className = "filter";
    label.textContent = "Rows with these words ";
    input.type = "search";
    input.spellcheck = false;
    input.autocomplete = "off";
    input.addEventListener("input", filter);
    count.textContent = `${rows.length} rows`;
    label.append(input);
    bar.append(label, count);
    table.parentElement.before(bar);
    // A link to a row that is filtered away shows all rows again.
    addEventListener("hashchange", () => {
      const target = document.getElementById(location.hash.slice(1));
      if (target && target.hidden && table.contains(target)) {
        input.value = "";
        filter();
        target.scrollIntoView();
      }
    });
  };

  for (const table of document.querySelectorAll("main table")) {
    sortable(table);
    if (table.hasAttribute("data-filter")) filterable(table);
  }
})();
