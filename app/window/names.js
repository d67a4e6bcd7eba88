// For screen readers: names for viser's controls that have none, and the statement on what the picture shows.
(() => {
  const REST_MS = 1000; // a statement is read when no newer one has come for so long
  const live = Object.assign(document.createElement("div"), {className: "packetmesh-statement"});
  live.setAttribute("role", "status");
  live.setAttribute("aria-live", "polite");
  let timer = 0;
  let source = null; // the element that states what is read; it leaves the page with its screen

  // The same sentence is not read twice in a row; a screen that is shown again states it anew.
  packetmesh.calls.state = (element, sentence) => {
    source = element;
    clearTimeout(timer);
    timer = setTimeout(() => {
      if (!live.isConnected) document.body.append(live);
      if (source?.isConnected && live.textContent !== sentence) live.textContent = sentence;
    }, REST_MS);
  };

  const ICONS = [ // names of viser's buttons that show only an icon
    [".mantine-Notification-closeButton", "Close the message"],
    [".mantine-CloseButton-root", "Close"],
    ["button:has(> .tabler-icon-settings), button:has(> .tabler-icon-adjustments)", "Settings of the view"],
    ["button", "Window"],
  ];

  function name(element, text) {
    if (text && !element.getAttribute("aria-label") && !element.hasAttribute("aria-labelledby")) element.setAttribute("aria-label", text);
  }

  // Sliders and drop-downs get the text of their label; icons and pictures get names of their own.
  function nameAll() {
    if (source && !source.isConnected) {
      source = null;
      live.textContent = "";
    }
    for (const label of document.querySelectorAll("label[for]")) {
      const row = label.parentElement.parentElement?.parentElement;
      if (!row) continue;
      for (const one of row.querySelectorAll("[role=slider], input")) if (one.id !== label.htmlFor) name(one, label.textContent.trim());
    }
    for (const one of document.querySelectorAll("[role=progressbar]")) name(one, "Progress");
    for (const one of document.querySelectorAll("div[aria-haspopup=dialog]")) { // the state of the connection
      one.setAttribute("role", "button");
      name(one, "Connection");
    }
    for (const one of document.querySelectorAll("input[value^='ws']")) name(one, "Address of the server");
    for (const one of document.querySelectorAll("button, [role=button]")) {
      if (one.textContent.trim() || one.querySelector("img[alt]:not([alt=''])")) continue;
      name(one, one.title || (ICONS.find(([selector]) => one.matches(selector)) ?? [])[1]);
    }
    for (const one of document.querySelectorAll("img:not([alt])")) one.alt = "";
  }

  let waiting = false;
  new MutationObserver(() => {
    if (waiting) return;
    waiting = true;
    setTimeout(() => { waiting = false; nameAll(); }, 300);
  }).observe(document.documentElement, {childList: true, subtree: true});
})();
