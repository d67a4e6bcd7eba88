// The buttons for all steps: Cancel, Retry and Reset are disabled while they have nothing to do.
(() => {
  const LAST = "Copy as command"; // the button that marks the row
  const STEPPER = "div:has(> .packetmesh-steps) + div";
  const BUTTON = "button:not([role=tab], .packetmesh-term)";
  const SETTING = `${BUTTON}, [role=option], [role=slider], .mantine-Slider-root, [type=checkbox]`;
  const NONE = `${STEPPER}, .mantine-Modal-root, .mantine-Spotlight-root, .packetmesh-tools, #packetmesh-landing`; // what has no settings
  const KEPT = ["screen", "cam"]; // parts of the address that Reset leaves as they are
  let idle = []; // buttons for which the server has nothing to do
  let used = false; // whether a setting was used since the last Reset

  const row = () => [...document.querySelectorAll("button")].find(one => one.textContent === LAST)?.parentElement;

  function draw() {
    const away = used || window.packetmeshAddress.changed.some(key => !KEPT.includes(key));
    for (const button of row()?.querySelectorAll("button") ?? [])
      button.disabled = idle.includes(button.textContent) || (button.textContent === "Reset" && !away);
  }

  function use({target, type, isTrusted}) {
    if (!target.closest) return;
    if (!row()?.contains(target))
      used ||= isTrusted && !target.closest(NONE) && (type === "input" || target.closest(SETTING) !== null);
    else if (type === "click" && target.closest("button")?.textContent === "Reset") used = false;
    setTimeout(draw); // after the click, which a disabled button would not get
  }
  for (const kind of ["click", "input", "keydown"]) document.addEventListener(kind, use, true);
  window.addEventListener("packetmesh-address", draw);

  packetmesh.calls.idle = (_, names) => {
    idle = names;
    draw();
  };
})();
