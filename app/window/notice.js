// Single lines at the lower edge of the picture. One takes the place of viser's notice that the picture is drawn in
// software, which would stay and cover the picture.
(() => {
  const TITLE = "Software WebGL rendering detected";
  const SHOWN_MS = 8000;
  const POLL_MS = 100;

  // Show a line in place of the one before it.
  function say(sentence, shownMs) {
    const picture = document.querySelector("canvas[data-engine]")?.parentElement.parentElement;
    if (!picture) return void setTimeout(say, POLL_MS, sentence, shownMs);
    document.querySelector(".packetmesh-notice")?.remove();
    const line = document.createElement("div");
    line.className = "packetmesh-notice";
    line.setAttribute("role", "status");
    line.textContent = sentence;
    picture.append(line);
    setTimeout(() => line.remove(), shownMs);
  }
  packetmesh.notice = say;

  const seen = new MutationObserver(() => {
    const notice = [...document.querySelectorAll("[role=alert]")].find(one => one.textContent.includes(TITLE));
    if (!notice) return;
    seen.disconnect();
    notice.style.display = "none"; // while it fades
    notice.querySelector("button")?.click();
    say("Drawn without a graphics card: the view turns slowly.", SHOWN_MS);
  });
  seen.observe(document.body, {childList: true, subtree: true});
})();
