// Explanations that open on a click: for names in tables and texts, and for labels of controls.
(() => {
  const GAP_PX = 6;
  const HINT_PX = 280; // width of viser's hints, and a margin
  const FARTHEST = 40; // most page elements between a label and its control
  const note = Object.assign(document.createElement("div"), {className: "packetmesh-hint"});
  note.setAttribute("role", "note");
  let about = null; // the element whose explanation is shown
  let stood = 0; // that element's top edge when the note opened, in px
  let passedOn = null; // checkbox that the browser clicks next because its label was clicked
  let waiting = false;

  // Return a control's hint; viser keeps it only in the React properties of the page.
  function hintOf(label) {
    const key = Object.keys(label).find(one => one.startsWith("__reactFiber$"));
    for (let made = label[key], up = 0; made && up < FARTHEST; made = made.return, up += 1) {
      const of = made.memoizedProps;
      if (of?.uuid === label.htmlFor && (of.hint ?? of.props?.hint)) return of.hint ?? of.props.hint;
    }
    return "";
  }

  function markLabels() {
    waiting = false;
    for (const label of document.querySelectorAll("label[for]:not([data-hint], [data-plain])")) {
      const hint = hintOf(label);
      label.dataset[hint ? "hint" : "plain"] = hint;
    }
  }

  function close() {
    note.remove();
    about = null;
  }

  const panelOf = one => one.closest?.(".mantine-ScrollArea-viewport")?.getBoundingClientRect();

  // Return the left and top edge of the note: over the picture beside or above the control panel, so that it covers
  // none of the panel's rows; below or above the element if that is elsewhere or there is no room.
  function place(one) {
    const at = one.getBoundingClientRect(), {width, height} = note.getBoundingClientRect();
    const panel = panelOf(one);
    if (panel && panel.left >= width + 2 * GAP_PX)
      return [panel.left - width - GAP_PX, Math.min(at.top, innerHeight - height - GAP_PX)];
    const left = Math.max(8, Math.min(at.left, innerWidth - width - 8));
    if (panel && panel.top >= height + 2 * GAP_PX) return [left, panel.top - height - GAP_PX];
    const below = at.bottom + GAP_PX + height < innerHeight;
    return [left, below ? at.bottom + GAP_PX : Math.max(8, at.top - GAP_PX - height)];
  }

  function show(one) {
    about = one;
    note.textContent = one.dataset.hint;
    document.body.append(note);
    stood = one.getBoundingClientRect().top;
    [note.style.left, note.style.top] = place(one).map(px => `${px}px`);
  }

  // Show an explanation that was found by its name, over the picture.
  packetmesh.calls.define = (_, name, hint) => {
    close();
    stood = undefined; // it belongs to nothing that could scroll
    note.replaceChildren(Object.assign(document.createElement("b"), {textContent: name}), `: ${hint}`);
    document.body.append(note);
    const picture = document.querySelector("canvas[data-engine]").getBoundingClientRect();
    const {width, height} = note.getBoundingClientRect();
    note.style.left = `${picture.left + Math.max(8, 0.5 * (picture.width - width))}px`;
    note.style.top = `${picture.top + Math.max(8, 0.4 * (picture.height - height))}px`;
  };

  // viser's own hints, which open while a mouse rests on a control, go beside the panel too.
  window.addEventListener("pointerover", ({target}) => {
    const panel = panelOf(target);
    if (!panel) return;
    const root = document.documentElement;
    root.classList.toggle("packetmesh-beside", panel.left >= HINT_PX);
    root.style.setProperty("--packetmesh-beside", `${innerWidth - panel.left + GAP_PX}px`);
  });

  window.addEventListener("click", event => {
    const one = event.target.closest?.("[data-hint]");
    if (passedOn && event.target === passedOn) { // the browser's own click on the label's checkbox
      passedOn = null;
      return;
    }
    const again = one === about;
    close();
    const control = one?.matches("label") ? document.getElementById(one.htmlFor) : null;
    passedOn = control?.matches("[type=checkbox]") ? control : null; // a click on the label also ticks the box, as everywhere
    if (!one || again) return;
    if (control && !passedOn) event.preventDefault(); // do not open the control's list
    show(one);
  }, true);
  window.addEventListener("keydown", event => event.key === "Escape" && close(), true);
  // Scroll events come a frame late and can follow the click that opened the note: check that it has moved.
  window.addEventListener("scroll", () => about?.getBoundingClientRect().top !== stood && close(), true);

  new MutationObserver(() => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(markLabels);
  }).observe(document.body, {childList: true, subtree: true});
})();
