// The row above the picture that shows a lesson, and the keys that lead through it.
(() => {
  const KEYS = {
    ArrowRight: "Next", PageDown: "Next", " ": "Next", ArrowLeft: "Back", PageUp: "Back", // the keys of a presenter
    1: "1", 2: "2", 3: "3", s: "Skip", S: "Skip",
  };
  const TYPING = "input:not([type=checkbox]), textarea, select, [role=slider], [role=dialog], [contenteditable=true]";
  const PRESSED_BY_SPACE = "button, input";
  const FOLDERS_MS = 600; // time for the folders of a stop to open

  const card = Object.assign(document.createElement("div"), {className: "packetmesh-lesson-card"});
  let mark = null; // mark of the lesson whose stop was shown last
  let folder = null; // the panel folder of that lesson
  let written = ""; // the card's HTML
  let docked = false; // whether the last pointer press was on the dock
  let waiting = false; // whether a frame is requested

  function buttons(around) {
    return [...around.querySelectorAll("button")];
  }

  // Return the folder of a lesson: the nearest ancestor of its mark that has its buttons.
  function folderOf(mark) {
    let around = mark.parentElement;
    while (around && !buttons(around).some(one => one.textContent === "Next")) around = around.parentElement;
    return around;
  }

  // Return a button of the lesson shown. Between two stops the mark is new but not yet announced.
  function button(name) {
    if (!folder?.isConnected || !folder.querySelector(".packetmesh-lesson")) return undefined;
    return buttons(folder).find(one => one.textContent === name);
  }

  // Press a button; for a student in a class a guess is a vote.
  function press(name) {
    if (!window.packetmeshLecture.vote(Number(name))) button(name)?.click();
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
    press(KEYS[event.key]);
  }, true);

  card.addEventListener("click", event => {
    const pressed = event.target.closest("[data-press]");
    if (!pressed) return;
    pressed.blur(); // or the space bar would press it again
    press(pressed.dataset.press);
  });

  // Draw the card. The control panel holds the text and the buttons, hidden; the card is made from them.
  function show() {
    waiting = false;
    if (!mark?.isConnected) frame([], []);
    const text = mark?.isConnected ? textOf(mark) : null;
    const home = window.packetmeshDockRow.root();
    if (!text || !home) return card.remove();
    const large = "large" in mark.dataset;
    const html = `<div class="told">${columns([...text.children], large)}</div>${row()}`;
    if (html !== written) {
      written = card.innerHTML = html;
      card.toggleAttribute("data-large", large);
      card.lang = mark.lang;
    }
    if (!card.isConnected) home.append(card);
  }

  // Return the text, and next to it the question with its choices or the answer. A row in large type is kept
  // low: before a guess it has title, question and choices; after it question, right answer and reason.
  function columns(parts, large) {
    const asked = parts.findIndex((one, index) => index > 0 && isQuestion(one));
    if (asked < 0) return `<div>${html(parts)}</div>`;
    const question = parts.slice(asked);
    const right = question.flatMap(one => [...one.querySelectorAll("li")]).find(one => one.textContent.trim().startsWith("✓"));
    if (!large) return `<div>${html(parts.slice(0, asked))}</div><div>${html(question)}</div>`;
    if (!right) return `<div>${html([parts[0], question[0]])}</div><div>${html(question.slice(1))}</div>`;
    const answer = Object.assign(document.createElement("p"), {textContent: right.textContent.trim()});
    return `<div>${html([question[0], answer])}</div><div>${html(question.slice(1).filter(one => !one.contains(right)))}</div>`;
  }

  // Return HTML of these parts; choices are buttons while the question waits for a guess.
  function html(parts) {
    const waits = button("1") !== undefined;
    const choice = (one, index) => {
      const voted = window.packetmeshLecture.voted === index + 1;
      return `<button type="button" class="choice" data-press="${index + 1}" aria-pressed="${voted}">` +
        `<b>${index + 1}</b><span>${one.innerHTML}</span></button>`;
    };
    return parts.map(one => waits && one.matches("ol") ? [...one.children].map(choice).join("") : one.outerHTML).join("");
  }

  function row() {
    const made = name => `<button type="button" data-press="${name}">${name === "End" ? "✕" : name}</button>`;
    const skip = button("Skip") ? made("Skip") : "";
    const end = made("End").replace(">", ' aria-label="End the lesson" title="End the lesson">');
    return `<div class="go"><span class="keys">${mark.querySelector(".keys").innerHTML}</span>` +
      `${skip}${made("Back")}${made("Next")}${end}</div>`;
  }

  // Whether the element is a paragraph that is bold as a whole.
  function isQuestion(one) {
    const bold = one.querySelector(":scope > strong, :scope > b");
    return one.matches("p") && bold !== null && bold.textContent.trim() === one.textContent.trim();
  }

  function textOf(mark) {
    for (let around = mark.parentElement; around; around = around.parentElement) {
      const found = [...around.querySelectorAll("p")].find(one => one.querySelector("strong, b"));
      if (found) return found.parentElement;
    }
    return null;
  }

  // Frame what a stop names and scroll to it: folders and tabs by title, controls and numbers by name.
  function frame(folders, names) {
    document.querySelectorAll(".packetmesh-here").forEach(one => one.classList.remove("packetmesh-here"));
    const called = (selector, titles) => [...document.querySelectorAll(selector)]
      .filter(one => titles.includes(one.textContent.trim()) && one.offsetParent !== null && !card.contains(one));
    const heads = [...document.querySelectorAll("svg[class*=tabler-icon-chevron-]")].map(arrow => arrow.parentElement)
      .filter(one => folders.includes(one.textContent.trim()) && one.offsetParent !== null);
    const named = [
      ...called("label", names).map(one => one.parentElement.parentElement.parentElement),
      ...called(".packetmesh-term", names).map(one => one.closest("tr") ?? one),
      ...called("button", names),
    ];
    const found = [
      ...heads.map(one => one.parentElement),
      ...called("[role=tab]", folders).map(one => one.closest("[role=tablist]").parentElement),
      ...named,
    ];
    found.forEach(one => one.classList.add("packetmesh-here"));
    const goal = named.length ? named : found;
    goal.sort((one, other) => one.compareDocumentPosition(other) & Node.DOCUMENT_POSITION_FOLLOWING ? -1 : 1);
    goal[0]?.scrollIntoView({block: "start"});
  }

  new MutationObserver(records => {
    if (waiting || !mark || records.every(record => card.contains(record.target))) return;
    waiting = true;
    requestAnimationFrame(show);
  }).observe(document.body, {childList: true, subtree: true, characterData: true});

  window.packetmeshLesson = {
    // Show the stop whose mark holds this element. It gets the keys, even if its drop-down was just used; a
    // list that the user has opened again meanwhile stays open.
    at(element, folders, names) {
      mark = element.closest(".packetmesh-lesson");
      folder = folderOf(mark);
      give(false);
      if (document.activeElement?.matches("input:not([aria-expanded=true])")) document.activeElement.blur();
      show();
      card.querySelector(".told")?.scrollTo(0, 0);
      setTimeout(frame, FOLDERS_MS, folders, names);
    },

    show,
  };
  packetmesh.calls.lesson = (element, opens, sees) => window.packetmeshLesson.at(element, opens, sees);
})();
