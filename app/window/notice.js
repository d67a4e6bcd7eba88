// One line instead of viser's notice that the picture is drawn in software: the notice would stay and cover the
// picture.
(() => {
  const TITLE = "Software WebGL rendering detected";
  const SHOWN_MS = 8000;
  const POLL_MS = 100;

  function say() {
    const picture = document.querySelector("canvas[data-engine]")?.parentElement.parentElement;
    if (!picture) return void setTimeout(say, POLL_MS);
    const line = document.createElement("div");
    line.className = "packetmesh-notice";
    line.setAttribute("role", "status");
    line.textContent = "Drawn without a graphics card: the view turns slowly.";
    picture.append(line);
    setTimeout(() => line.remove(), SHOWN_MS);
  }

  const seen = new MutationObserver(() => {
    const notice = [...document.querySelectorAll("[role=alert]")].find(one => one.textContent.includes(TITLE));
    if (!notice) return;
    seen.disconnect();
    notice.style.display = "none"; // while it fades
    notice.querySelector("button")?.click();
    say();
  });
  seen.observe(document.body, {childList: true, subtree: true});
})();
