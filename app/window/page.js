// What PacketMesh adds to viser's page. The server calls a function of packetmesh.calls by adding an element
// with its name and arguments to the page; every time such an element appears, the function runs (page.py).
(() => {
  const calls = Object.create(null);

  function call(element) {
    const {packetmeshCall: name, arguments: given} = element.dataset;
    if (name in calls) calls[name](element, ...JSON.parse(given));
  }

  new MutationObserver(changes => {
    const come = new Set(); // a set: an element that was added inside another appears twice
    for (const {addedNodes} of changes)
      for (const node of addedNodes) {
        if (node.nodeType !== Node.ELEMENT_NODE || !node.isConnected) continue;
        if (node.matches("[data-packetmesh-call]")) come.add(node);
        for (const one of node.querySelectorAll("[data-packetmesh-call]")) come.add(one);
      }
    for (const element of come) queueMicrotask(() => call(element)); // an error in one call stops no other
  }).observe(document.documentElement, {childList: true, subtree: true});

  // viser prepares Gaussian splats, which the app never draws, with code that the content policy forbids. It
  // waits for that module, which never arrives.
  const {fetch} = window;
  window.fetch = (from, ...options) => String(from).startsWith("data:application/wasm")
    ? new Promise(() => {})
    : fetch(from, ...options);

  // Actions of buttons in HTML, which get no other click handler.
  const PRESSED = {
    // Copy the text before the button.
    packetmeshCopy(button) {
      navigator.clipboard.writeText(button.previousElementSibling.textContent);
      button.textContent = "Copied";
    },
    // Press the panel's own button with this label.
    packetmeshPress(button, name) {
      [...document.querySelectorAll("button")].find(one => one.textContent === name && one !== button)?.click();
    },
    // Write into the hidden field after the HTML. The time makes a repeated choice a new text.
    packetmeshPick(button, name) {
      const html = button.closest("[data-packetmesh-field]");
      const input = html.parentElement.nextElementSibling.querySelector("input");
      const text = JSON.stringify([name, Date.now()]);
      Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(input, text);
      input.dispatchEvent(new Event("input", {bubbles: true}));
    },
  };
  document.addEventListener("click", event => {
    const button = event.target.closest?.("button");
    for (const [name, press] of Object.entries(PRESSED))
      if (button && name in button.dataset) press(button, button.dataset[name]);
  });

  // While anything new arrives, viser draws frame after frame, most of them equal. Without a graphics card
  // that takes the time needed for the next mesh. A held view draws only frames with a new mesh. While a
  // mesh is awaited whose place is empty, nothing is drawn.
  const HELD_MS = 6000; // longest hold after the last call
  const AWAITED_MS = 3000; // longest wait for meshes before the answer is given without them
  const POLL_MS = 4;
  const UNFOLD_MS = 200; // pause before a missing folder is looked for again
  const UNFOLD_TRIES = 10;
  const KEY = {key: "Insert", ctrlKey: true, altKey: true, shiftKey: true};

  let gl = null; // WebGL context of viser's canvas
  let held = false;
  let until = 0; // end of the hold by the page's clock, ms
  let awaited = []; // vertex counts of the awaited meshes
  let empty = false; // whether their place is empty until they come
  let arrived = []; // vertex counts of the meshes that arrived since the last answer, held or awaited
  let whole = false; // whether the next frame has all awaited meshes
  let asked = 0;
  let frame = null;
  let skipped = false;
  let width = 0;
  let height = 0;

  function answer(question) {
    if (question !== asked) return; // a newer question is open
    asked += 1;
    awaited = [];
    arrived = [];
    whole = false;
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", KEY));
  }

  function beginFrame() {
    const late = performance.now() > until;
    const emptied = width !== gl.drawingBufferWidth || height !== gl.drawingBufferHeight; // a new size clears the canvas
    [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    skipped = !whole && !late && !emptied && (held || empty && awaited.length > 0);
    if (whole) queueMicrotask(answerWhenDrawn); // after all drawing calls of this frame
    whole = false;
  }

  function answerWhenDrawn() {
    const question = asked;
    const drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    const look = () => {
      if (gl.getSyncParameter(drawn, gl.SYNC_STATUS) !== gl.SIGNALED) return setTimeout(look, POLL_MS);
      gl.deleteSync(drawn);
      answer(question);
    };
    setTimeout(look, POLL_MS);
  }

  // Note a new mesh; three.js uploads its vertices before it clears the frame.
  function uploaded(vertices) {
    if (held || awaited.length > 0) arrived.push(vertices);
    if (!awaited.includes(vertices)) return;
    awaited.splice(awaited.indexOf(vertices), 1);
    whole = awaited.length === 0;
  }

  function before(name, action) {
    const call = gl[name];
    gl[name] = (...parameters) => {
      action(...parameters);
      if (!skipped || name === "bufferData") call.apply(gl, parameters);
    };
  }

  function watch() {
    if (gl?.canvas.isConnected) return;
    gl = document.querySelector("canvas[data-engine]")?.getContext("webgl2") ?? null;
    if (gl === null) return;
    before("clear", () => {
      if (frame === document.timeline.currentTime) return;
      frame = document.timeline.currentTime;
      beginFrame();
    });
    for (const name of ["drawElements", "drawArrays", "drawElementsInstanced", "drawArraysInstanced"])
      before(name, () => {});
    before("bufferData", (target, data) => target === gl.ARRAY_BUFFER && uploaded(data?.length / 3));
  }

  // The user's input may turn the view, so it ends the hold; a hand or an arrow key on a slider does not.
  let sliding = false;
  window.addEventListener("pointerdown", event => { sliding = event.target.closest(".mantine-Slider-root") !== null; }, true);
  for (const kind of ["pointerdown", "pointerup", "wheel"])
    window.addEventListener(kind, () => { held &&= sliding; }, true);
  document.body.onkeydown = event => {
    if (event.target.closest("[role=slider]")) event.stopPropagation();
    else held = false;
  };

  // Open folders and tabs. A closed folder has a downward arrow in its title; a tab has an attribute.
  function unfold(titles, tries = UNFOLD_TRIES) {
    const shut = [...document.querySelectorAll("svg.tabler-icon-chevron-down")].map(arrow => arrow.parentElement);
    const tabs = [...document.querySelectorAll("[role=tab][aria-selected=false]")];
    const found = [...shut, ...tabs].filter(head => titles.includes(head.textContent.trim()) && head.offsetParent !== null);
    for (const head of found) head.click();
    const left = titles.filter(title => !found.some(head => head.textContent.trim() === title));
    if (left.length > 0 && tries > 1) setTimeout(unfold, UNFOLD_MS, left, tries - 1);
  }

  // viser forgets which folders were open when another screen is shown; the page remembers it in this tab.
  const REMEMBERED = "packetmesh-folders";
  const HEADS = "svg[class*=tabler-icon-chevron-]";
  const folders = () => JSON.parse(sessionStorage.getItem(REMEMBERED) ?? "{}"); // open or not, by screen, title and the title's count

  function heads() {
    const screen = document.querySelector("[data-packetmesh-screen]")?.dataset.packetmeshScreen;
    const counts = {};
    return [...document.querySelectorAll(HEADS)].map(arrow => {
      const title = arrow.parentElement.textContent.trim();
      counts[title] = (counts[title] ?? 0) + 1;
      const open = arrow.classList.contains("tabler-icon-chevron-up");
      return {head: arrow.parentElement, key: `${screen}/${title}/${counts[title]}`, open};
    });
  }

  document.addEventListener("click", event => {
    const clicked = heads().find(one => one.head.contains(event.target));
    if (!clicked) return;
    sessionStorage.setItem(REMEMBERED, JSON.stringify({...folders(), [clicked.key]: !clicked.open}));
  }, true);

  // A screen is shown: open and close its folders as they were left.
  calls.shown = () => {
    const left = folders();
    for (const {head, key, open} of heads())
      if (left[key] !== undefined && left[key] !== open) head.click();
  };

  // Open folders and tabs by their titles; retry for a second or two those that are not there yet.
  calls.unfold = (_, titles) => unfold(titles);
  calls.hold = () => window.packetmesh.hold();
  calls.ask = (_, vertices, hold) => window.packetmesh.ask(vertices, hold);

  window.packetmesh = {
    calls,

    // Draw only new meshes from now on, and press a key.
    hold() {
      watch();
      held = true;
      until = performance.now() + HELD_MS;
      answer(++asked);
    },

    // Press a key once meshes with these vertex counts are drawn; without counts, once those still awaited are.
    // If there are none, press it when the next frame is drawn if the view is or stays held, and else two frames
    // later. If the view stays held, the place of these meshes is empty until they come.
    ask(vertices, hold) {
      watch();
      const question = ++asked;
      held = hold;
      until = performance.now() + HELD_MS;
      if (vertices.length > 0) {
        awaited = vertices.filter(count => !arrived.includes(count));
        empty = hold;
      }
      const nothing = !hold && vertices.length === 0 && awaited.length === 0;
      whole = !nothing && awaited.length === 0;
      if (gl === null || nothing)
        requestAnimationFrame(() => requestAnimationFrame(() => answer(question)));
      else setTimeout(answer, AWAITED_MS, question);
    },
  };
})();
