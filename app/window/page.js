// What PacketMesh adds to viser's page, and how the server calls it: an element with the name of one of
// packetmesh.calls and its arguments, each time it comes into the page (page.py).
(() => {
  const calls = Object.create(null);

  function call(element) {
    const {packetmeshCall: name, arguments: given} = element.dataset;
    if (name in calls) calls[name](element, ...JSON.parse(given));
  }

  new MutationObserver(changes => {
    const come = new Set(); // once each, also if it and what it lies in came one after the other
    for (const {addedNodes} of changes)
      for (const node of addedNodes) {
        if (node.nodeType !== Node.ELEMENT_NODE || !node.isConnected) continue;
        if (node.matches("[data-packetmesh-call]")) come.add(node);
        for (const one of node.querySelectorAll("[data-packetmesh-call]")) come.add(one);
      }
    for (const element of come) queueMicrotask(() => call(element)); // one that fails stops no other
  }).observe(document.documentElement, {childList: true, subtree: true});

  // viser makes itself ready for Gaussian splats, which the app never draws, with code made of text, which the
  // content policy forbids: it waits for that module and never gets it.
  const {fetch} = window;
  window.fetch = (from, ...options) => String(from).startsWith("data:application/wasm")
    ? new Promise(() => {})
    : fetch(from, ...options);

  // Buttons in HTML, which is told nothing else of a click.
  const PRESSED = {
    // Copy the text before it.
    packetmeshCopy(button) {
      navigator.clipboard.writeText(button.previousElementSibling.textContent);
      button.textContent = "Copied";
    },
    // Press the panel's own button of that name.
    packetmeshPress(button, name) {
      [...document.querySelectorAll("button")].find(one => one.textContent === name && one !== button)?.click();
    },
    // Write into the hidden field behind the HTML; with the time, as the same may be picked again.
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

  // While anything new arrives, viser draws one frame after another, most of them alike. Without a
  // graphics card that takes the time in which the next mesh is made. A view that is held draws only frames
  // in which a mesh is new. And while a mesh is awaited, its place may be empty: then nothing is drawn.
  const HELD_MS = 6000; // at most, since the last call
  const AWAITED_MS = 3000; // at most, before the answer is given without
  const POLL_MS = 4;
  const UNFOLD_MS = 200; // before it is seen again whether a folder has come
  const UNFOLD_TRIES = 10;
  const KEY = {key: "Insert", ctrlKey: true, altKey: true, shiftKey: true};

  let gl = null; // what viser draws with
  let held = false;
  let until = 0; // held so long, by the page's clock in ms
  let awaited = []; // numbers of vertices of the meshes to come
  let arrived = []; // those that came while the view was held, since the last answer
  let whole = false; // whether the next frame has all that was awaited
  let asked = 0;
  let frame = null;
  let skipped = false;
  let width = 0;
  let height = 0;

  function answer(question) {
    if (question !== asked) return; // there is a newer one
    asked += 1;
    awaited = [];
    arrived = [];
    whole = false;
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", KEY));
  }

  function beginFrame() {
    const late = performance.now() > until;
    const emptied = width !== gl.drawingBufferWidth || height !== gl.drawingBufferHeight; // by a new size
    [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
    skipped = !whole && !late && !emptied && (held || awaited.length > 0);
    if (whole) queueMicrotask(answerWhenDrawn); // after all calls of this frame
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

  // Of a new mesh, three.js uploads the vertices before it clears the frame.
  function uploaded(vertices) {
    if (held) arrived.push(vertices);
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

  // What a hand does now may turn the view; only arrow keys on a slider do not, though viser would turn it.
  for (const kind of ["pointerdown", "pointerup", "wheel"])
    window.addEventListener(kind, () => { held = false; }, true);
  document.body.onkeydown = event => {
    if (event.target.closest("[role=slider]")) event.stopPropagation();
    else held = false;
  };

  // viser keeps to itself whether a folder is open; its title has an arrow down while it is not. A tab says it.
  function unfold(titles, tries = UNFOLD_TRIES) {
    const shut = [...document.querySelectorAll("svg.tabler-icon-chevron-down")].map(arrow => arrow.parentElement);
    const tabs = [...document.querySelectorAll("[role=tab][aria-selected=false]")];
    const found = [...shut, ...tabs].filter(head => titles.includes(head.textContent.trim()) && head.offsetParent !== null);
    for (const head of found) head.click();
    const left = titles.filter(title => !found.some(head => head.textContent.trim() === title));
    if (left.length > 0 && tries > 1) setTimeout(unfold, UNFOLD_MS, left, tries - 1);
  }

  // When another screen is shown viser forgets which folders of the one before were open; the page remembers
  // it as long as the tab is there.
  const REMEMBERED = "packetmesh-folders";
  const HEADS = "svg[class*=tabler-icon-chevron-]";
  const folders = JSON.parse(sessionStorage.getItem(REMEMBERED) ?? "{}"); // by screen, title and count of it

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
    folders[clicked.key] = !clicked.open;
    sessionStorage.setItem(REMEMBERED, JSON.stringify(folders));
  }, true);

  // A screen is shown: its folders are as they were left.
  calls.shown = () => {
    for (const {head, key, open} of heads())
      if (folders[key] !== undefined && folders[key] !== open) head.click();
  };

  // Open folders and tabs by their titles; those that are not there yet, when they come within a second or two.
  calls.unfold = (_, titles) => unfold(titles);
  calls.hold = () => window.packetmesh.hold();
  calls.ask = (_, vertices, hold) => window.packetmesh.ask(vertices, hold);

  window.packetmesh = {
    calls,

    // Draw nothing but new meshes for now.
    hold() {
      watch();
      held = true;
      until = performance.now() + HELD_MS;
    },

    // Press a key once meshes of so many vertices are drawn, and those that are awaited still; without any,
    // when the next frame is drawn if the view is held, as it goes on to be or not, and else two frames later.
    ask(vertices, hold) {
      watch();
      const question = ++asked;
      held = hold;
      until = performance.now() + HELD_MS;
      if (vertices.length > 0) awaited = vertices.filter(count => !arrived.includes(count));
      const nothing = !hold && vertices.length === 0 && awaited.length === 0;
      whole = !nothing && awaited.length === 0;
      if (gl === null || nothing)
        requestAnimationFrame(() => requestAnimationFrame(() => answer(question)));
      else setTimeout(answer, AWAITED_MS, question);
    },
  };
})();
