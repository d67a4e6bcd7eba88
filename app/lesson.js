// Lessons in the page: the keys that lead through one, and its text large over the picture.
(() => {
  if (window.packetmeshLesson) return;

  const KEYS = {
    ArrowRight: "Next", PageDown: "Next", " ": "Next", ArrowLeft: "Back", PageUp: "Back", // or a presenter's
    1: "1", 2: "2", 3: "3", s: "Skip", S: "Skip",
  };
  const TYPING = "input:not([type=checkbox]), textarea, select, [role=slider], [role=dialog], [contenteditable=true]";
  const PRESSED_BY_SPACE = "button, input";
  const EDGE_PX = 16; // between the card and the picture's edges
  const FOLDERS_MS = 600; // until the folders of a stop are open

  const card = Object.assign(document.createElement("div"), {className: "packetmesh-lesson-card"});
  let mark = null; // of the lesson whose stop was shown last
  let folder = null; // that it stands in
  let docked = false; // whether a hand was last on the dock
  let waiting = false; // for the next frame

  function buttons(around) {
    return [...around.querySelectorAll("button")];
  }

  // The folder of a lesson: the nearest around its mark that has its buttons.
  function folderOf(mark) {
    let around = mark.parentElement;
    while (around && !buttons(around).some(one => one.textContent === "Next")) around = around.parentElement;
    return around;
  }

  // One that is seen of the lesson that is shown. Between two stops there is a new mark before it is told of.
  function button(name) {
    if (!folder?.isConnected || !folder.querySelector(".packetmesh-lesson")) return undefined;
    return buttons(folder).find(one => one.textContent === name && one.offsetParent !== null);
  }

  function give(toDock) {
    docked = toDock;
    document.documentElement.classList.toggle("packetmesh-keys-docked", docked);
  }

  window.addEventListener("pointerdown", event => {
    give(event.target.closest?.(".packetmesh-dock-row") != null);
  }, true);

  window.addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey || !button("Next")) return;
    if (docked) {
      if (event.key === "Escape") give(false);
      return;
    }
    if (!(event.key in KEYS) || event.target.closest?.(TYPING)) return;
    if (event.key === " " && event.target.closest?.(PRESSED_BY_SPACE)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    button(KEYS[event.key])?.click();
  }, true);

  // The text stands in the control panel, before the buttons; what is large is a copy of what a class needs, as
  // low a strip as it can be, for below it is what the lesson speaks of.
  function show() {
    waiting = false;
    if (!mark?.isConnected) frame([]);
    const canvas = document.querySelector("canvas[data-engine]");
    const text = mark?.isConnected && "large" in mark.dataset && canvas ? written() : null;
    if (!text) return card.remove();
    const html = strip([...text.children]);
    const changed = card.innerHTML !== html;
    if (changed) card.innerHTML = html;
    const {left, top, width, height} = canvas.getBoundingClientRect();
    Object.assign(card.style, {
      left: `${left + EDGE_PX}px`, top: `${top + EDGE_PX}px`, maxWidth: `${width - 2 * EDGE_PX - 1}px`,
      maxHeight: `${height - 2 * EDGE_PX}px`,
    });
    if (!card.isConnected) document.body.append(card);
    if (changed) card.scrollTop = 0;
  }

  // Before a guess the title, the question and its choices; then the question, what is right and why.
  function strip(parts) {
    const asked = parts.findIndex((one, index) => index > 0 && isQuestion(one));
    const right = parts.flatMap(one => [...one.querySelectorAll("li")]).find(one => one.textContent.trim().startsWith("✓"));
    const kept = parts.filter((one, index) => right ? index >= asked && !one.contains(right) : index === 0 || index >= asked);
    if (right) kept.splice(1, 0, Object.assign(document.createElement("p"), {textContent: right.textContent.trim()}));
    return kept.map(one => one.outerHTML).join("");
  }

  // A paragraph that is bold from end to end.
  function isQuestion(one) {
    const bold = one.querySelector(":scope > strong, :scope > b");
    return one.matches("p") && bold !== null && bold.textContent.trim() === one.textContent.trim();
  }

  function written() {
    for (let around = mark.parentElement; around; around = around.parentElement) {
      const found = [...around.querySelectorAll("p")].find(one => !card.contains(one) && one.querySelector("strong, b"));
      if (found) return found.parentElement;
    }
    return null;
  }

  // The folders that the stop speaks of are framed, and in view where the text stands elsewhere.
  function frame(titles) {
    document.querySelectorAll(".packetmesh-here").forEach(one => one.classList.remove("packetmesh-here"));
    const heads = [...document.querySelectorAll("svg[class*=tabler-icon-chevron-]")].map(arrow => arrow.parentElement);
    for (const head of heads.filter(one => titles.includes(one.textContent.trim()) && one.offsetParent !== null)) {
      head.parentElement.classList.add("packetmesh-here");
      if (card.isConnected) head.parentElement.scrollIntoView({block: "center"});
    }
  }

  new MutationObserver(records => {
    if (waiting || !mark || records.every(record => card.contains(record.target))) return;
    waiting = true;
    requestAnimationFrame(show);
  }).observe(document.body, {childList: true, subtree: true, characterData: true});
  window.addEventListener("resize", show);

  window.packetmeshLesson = {
    // A stop is shown whose mark holds this image: the keys are its own, also after its list was used. A list
    // that somebody has opened again meanwhile stays open.
    at(image, titles) {
      mark = image.closest(".packetmesh-lesson");
      folder = folderOf(mark);
      give(false);
      if (document.activeElement?.matches("input:not([aria-expanded=true])")) document.activeElement.blur();
      show();
      setTimeout(frame, FOLDERS_MS, titles);
    },
  };
})();
