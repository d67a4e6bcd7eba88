// The landing: a click opens a lesson or a scene, as hands would; Escape leaves to the scene behind it.
(() => {
  const landing = document.getElementById("packetmesh-landing");

  const POLL_MS = 50;
  const POLL_TRIES = 1200; // a slow machine takes its time to begin
  const buttons = () => [...document.querySelectorAll("button")].filter(one => !landing.contains(one));
  const starting = text => () => buttons().find(one => one.textContent.startsWith(text));

  // Do something with what there is to be, once it is there.
  function once(find, act, tries = POLL_TRIES) {
    const found = find();
    if (found) act(found);
    else if (tries > 0) setTimeout(once, POLL_MS, find, act, tries - 1);
  }

  function leave() {
    landing.remove();
    window.removeEventListener("keydown", escape, true);
  }

  function escape(event) {
    if (event.key !== "Escape") return;
    event.stopImmediatePropagation();
    leave();
  }

  function openScene(name) {
    once(starting(`Open scene ${name}`), button => { button.click(); leave(); });
  }

  function openLesson(step, title) {
    const label = `Lesson: ${title}`;
    const seen = element => element.offsetParent !== null;
    const head = () => [...document.querySelectorAll("svg.tabler-icon-chevron-down")]
      .map(arrow => arrow.parentElement).find(one => one.textContent.trim() === label && seen(one));
    const next = folder => () => [...folder.querySelectorAll("button")].find(one => one.textContent === "Next" && seen(one));
    once(starting(step), button => {
      button.click();
      once(head, found => {
        found.click();
        once(next(found.parentElement), go => { go.click(); leave(); });
      });
    });
  }

  landing.addEventListener("click", event => {
    const card = event.target.closest("button");
    if (!card) return;
    if ("explore" in card.dataset) return leave();
    landing.style.cursor = "progress";
    if (card.dataset.scene) openScene(card.dataset.scene);
    else openLesson(card.dataset.step, card.dataset.title);
  });
  window.addEventListener("keydown", escape, true);
  landing.querySelector("[data-explore]").focus();
})();
