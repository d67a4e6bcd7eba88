// The landing page: a click opens a lesson or a scene; Escape closes the page and shows the scene behind it.
(() => {
  const landing = document.getElementById("packetmesh-landing");
  if (!landing) return;

  const POLL_MS = 50;
  const POLL_TRIES = 1200; // slow machines need minutes to start
  // Call `act` with the result of `find` as soon as there is one.
  function once(find, act, tries = POLL_TRIES) {
    const found = find();
    if (found) act(found);
    else if (tries > 0) setTimeout(once, POLL_MS, find, act, tries - 1);
  }

  const shared = "lecture" in landing.dataset; // a lecture's session has no address of its own

  function leave() {
    landing.remove();
    if (shared) history.replaceState(null, "", location.pathname); // or a reload would show the landing again
    window.removeEventListener("keydown", escape, true);
  }

  function escape(event) {
    if (event.key !== "Escape") return;
    event.stopImmediatePropagation();
    leave();
  }

  function goTo(place) {
    const screen = new URLSearchParams(place).get("screen");
    const steps = () => [...document.querySelectorAll("div:has(> .packetmesh-steps) + div button")];
    if (shared) once(() => steps().find(one => one.textContent.toLowerCase().startsWith(screen)), step => step.click());
    else window.packetmeshAddress.ask(place);
  }

  const seen = element => element.offsetParent !== null;

  // Open the folder of this label, and call `act` with it.
  function openFolder(label, act) {
    const head = () => [...document.querySelectorAll("svg.tabler-icon-chevron-down")]
      .map(arrow => arrow.parentElement).find(one => one.textContent.trim() === label && seen(one));
    once(head, found => {
      found.click();
      act(found.parentElement);
    });
  }

  function openLesson(title) {
    const next = folder => () => [...folder.querySelectorAll("button")].find(one => one.textContent === "Next" && seen(one));
    openFolder(`Lesson: ${title}`, folder => once(next(folder), go => { go.click(); leave(); }));
  }

  landing.addEventListener("click", event => {
    const card = event.target.closest("button");
    if (!card) return;
    if ("explore" in card.dataset) return leave();
    landing.style.cursor = "progress";
    goTo(card.dataset.place);
    if ("lesson" in card.dataset) openLesson(card.dataset.lesson);
    else if ("folder" in card.dataset) openFolder(card.dataset.folder, leave);
    else leave();
  });
  window.addEventListener("keydown", escape, true);
  landing.inert = false; // earlier clicks would have no effect
  landing.querySelector("[data-explore]").focus();
})();
