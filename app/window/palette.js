// The keys that work on every screen, the buttons that press them, the command palette, and the stage alone.
// The server's part is palette.py: each key belongs to an entry of viser's palette, which hears it.
(() => {
  const TEXT = "input:not([type=checkbox], [type=radio], [type=button]), textarea, select, [contenteditable=true]";
  const CLOSED_LIST = "[aria-haspopup=listbox]:not([data-expanded])"; // still has the keyboard after a choice
  const HIDDEN = "Say that all is drawn"; // an entry for the page itself
  const FOUND_MS = 4000; // longest wait for the palette to open
  const POLL_MS = 100;
  const POINT_MS = Array.from({length: 25}, (_, count) => 300 + 400 * count); // when a control to point at is looked for
  const SAID_MS = 4000;
  const ROOT = document.documentElement;
  const back = Object.assign(document.createElement("button"), {
    type: "button", className: "packetmesh-back", textContent: "Leave full screen (Esc)", onclick: () => comeBack(),
  });
  let said = 0;
  const STEPPER_PX = 100; // lower edge of the steps, which stay above the panel's controls
  let timers = [];
  ROOT.classList.toggle("packetmesh-mac", /Mac|iPhone|iPad/.test(navigator.platform));

  // Press a key for viser, which hears it on the page's root. It has no code: viser would take the key's place
  // on an American keyboard for its letter.
  function press(name) {
    const parts = name.split("+"), key = parts.pop();
    if (name === "m") return standAlone();
    ROOT.dispatchEvent(new KeyboardEvent("keydown", {
      key, ctrlKey: parts.includes("mod"), shiftKey: parts.includes("shift"), bubbles: true,
    }));
  }

  // Return the name of the pressed key, empty if it is none of ours.
  function nameOf(event) {
    const key = event.key.toLowerCase(), mod = event.ctrlKey || event.metaKey;
    if (event.altKey || event.isComposing) return "";
    if (mod && key === "z") return event.shiftKey ? "mod+shift+z" : "mod+z";
    if (mod && !event.shiftKey && key === "y") return "mod+shift+z";
    if (!mod && key === "?") return "mod+k";
    const letters = document.querySelector(".packetmesh-tools")?.dataset.letters ?? ""; // tools.py
    return !mod && !event.shiftKey && key.length === 1 && letters.includes(key) ? key : "";
  }

  function types(target, name) {
    if (!target.matches?.(TEXT)) return false;
    return !(name.endsWith("z") && target.matches(CLOSED_LIST));
  }

  window.addEventListener("keydown", event => {
    if (!event.isTrusted) return;
    if (event.key === "Escape" && ROOT.classList.contains("packetmesh-alone")) return comeBack();
    const name = nameOf(event);
    if (!name || types(event.target, name) || document.querySelector("[role=dialog]")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!event.repeat || name.endsWith("z")) press(name);
  }, true);

  document.addEventListener("click", event => {
    const button = event.target.closest?.("[data-packetmesh-key], [data-packetmesh-find]");
    if (!button) return;
    button.blur(); // or the space bar would press it again
    if (button.dataset.packetmeshFind) find(button.dataset.packetmeshFind);
    else press(button.dataset.packetmeshKey);
  });

  // Open the palette with a text typed in.
  function find(text, tries = FOUND_MS / POLL_MS) {
    const field = document.querySelector("input.mantine-Spotlight-search");
    if (!field) {
      if (tries === FOUND_MS / POLL_MS) press("mod+k");
      if (tries > 0) setTimeout(find, POLL_MS, text, tries - 1);
      return;
    }
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(field, text);
    field.dispatchEvent(new Event("input", {bubbles: true}));
  }

  new MutationObserver(() => {
    for (const entry of document.querySelectorAll(".mantine-Spotlight-action[data-action]"))
      if (entry.textContent.startsWith(HIDDEN)) {
        entry.removeAttribute("data-action");
        entry.style.display = "none";
      }
  }).observe(document.body, {childList: true, subtree: true});

  // The stage alone, in the whole screen where the browser can; Escape comes back.
  function standAlone() {
    if (ROOT.classList.contains("packetmesh-alone")) return comeBack();
    ROOT.classList.add("packetmesh-alone");
    document.body.append(back);
    window.dispatchEvent(new Event("packetmesh-alone"));
    ROOT.requestFullscreen?.().catch(() => {}); // then it fills the window
  }

  function comeBack() {
    ROOT.classList.remove("packetmesh-alone");
    back.remove();
    window.dispatchEvent(new Event("packetmesh-alone"));
    if (document.fullscreenElement) document.exitFullscreen();
  }
  document.addEventListener("fullscreenchange", () => document.fullscreenElement || comeBack());

  // Return the row of a control or folder that is shown: by the name of its label, or by its text.
  function rowOf(name, label) {
    const heads = [...document.querySelectorAll("svg[class*=tabler-icon-chevron-]")].map(arrow => arrow.parentElement)
      .filter(head => head.textContent.trim() === label);
    const buttons = [...document.querySelectorAll("button")].filter(one => one.textContent.trim() === label);
    const labels = [...document.querySelectorAll("label")].filter(one => one.htmlFor === name || one.textContent.trim() === label);
    labels.sort((one, other) => (other.htmlFor === name) - (one.htmlFor === name));
    const found = [...labels, ...heads, ...buttons].find(one => one.offsetParent !== null && !one.closest("[role=dialog]"));
    return found?.matches("label") ? found.parentElement.parentElement.parentElement : found;
  }

  // Frame a row until something is pressed. It is looked for again: viser may draw it anew, and folders that open
  // move it.
  function point(name, label) {
    leave();
    for (const kind of ["pointerdown", "keydown", "wheel"]) window.addEventListener(kind, leave, true);
    timers = POINT_MS.map(wait => setTimeout(() => {
      const row = rowOf(name, label);
      if (!row) return;
      const {top, bottom} = row.getBoundingClientRect();
      const placed = row.classList.contains("packetmesh-pointed") && top > STEPPER_PX && bottom < innerHeight;
      row.classList.add("packetmesh-pointed");
      if (!placed) row.scrollIntoView({block: "center"});
    }, wait));
  }

  // The page itself presses Insert when it has drawn (page.js): such presses are not trusted.
  function leave(event) {
    if (event?.isTrusted === false) return;
    for (const timer of timers) clearTimeout(timer);
    for (const row of document.querySelectorAll(".packetmesh-pointed")) row.classList.remove("packetmesh-pointed");
    for (const kind of ["pointerdown", "keydown", "wheel"]) window.removeEventListener(kind, leave, true);
  }

  Object.assign(packetmesh.calls, {
    standAlone,

    point(_, folders, name, label) {
      comeBack();
      packetmesh.calls.unfold(_, folders);
      point(name, label);
    },

    // Tell the server the size of the view, and its scale bar if it has one (scale_bar.py).
    measureView(_, field) {
      const {clientWidth, clientHeight} = document.querySelector("canvas[data-engine]");
      const bar = document.querySelector(".packetmesh-scale")?.dataset.bar ?? "";
      window.packetmeshDockRow.write(field, `${said += 1} ${clientWidth} ${clientHeight} ${bar}`.trim());
    },

    say: (_, sentence) => packetmesh.notice(sentence, SAID_MS),
  });
})();
