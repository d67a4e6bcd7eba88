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

  const shared = "lecture" in landing.dataset; // the session of a lecture is older than this page

  // Remove the landing, also from the address, or a reload would show it again.
  function leave() {
    landing.remove();
    const query = new URLSearchParams(location.search);
    query.delete("welcome");
    history.replaceState(null, "", `${location.pathname}${`?${query}`.replace(/\?$/, "")}`);
    window.removeEventListener("keydown", escape, true);
  }

  function escape(event) {
    if (event.key !== "Escape") return;
    event.stopImmediatePropagation();
    leave();
  }

  // Open a place, and call `act` then. One without a scene leaves a lecture's class in the scene that it sees.
  function goTo(place, act) {
    const ask = kept => {
      window.packetmeshAddress.ask(kept + place);
      act();
    };
    if (!shared || new URLSearchParams(place).has("scene")) return ask("");
    const settings = () => [...new URLSearchParams(location.search)].filter(([key]) => ["scene", "preset", "set"].includes(key));
    once(() => settings().length, () => ask(`${new URLSearchParams(settings())}&`));
  }

  const seen = element => element.offsetParent !== null;
  const lesson = () => window.packetmeshAddress.received && document.querySelector(".packetmesh-lesson");

  // Open the folder with this label, and leave.
  function openFolder(label) {
    const head = () => window.packetmeshAddress.received && [...document.querySelectorAll("svg.tabler-icon-chevron-down")]
      .map(arrow => arrow.parentElement).find(one => one.textContent.trim() === label && seen(one));
    once(head, found => {
      found.click();
      leave();
    });
  }

  // The cards of the lessons are in the chosen language, at first the one that the browser prefers.
  const choice = landing.querySelector("[data-languages] select");
  const offered = [...choice.options].map(one => one.value);
  const preferred = navigator.languages.map(one => one.split("-")[0].toLowerCase()).find(one => offered.includes(one)) ?? "en";
  choice.value = preferred;
  choice.closest("label").hidden = shared || offered.length < 2; // a lecture's language is chosen in its lesson

  function translate() {
    for (const card of landing.querySelectorAll("[data-titles]")) {
      const titles = JSON.parse(card.dataset.titles);
      const language = !shared && choice.value in titles ? choice.value : Object.keys(titles)[0];
      Object.assign(card.querySelector("span"), {textContent: titles[language], lang: language});
    }
  }
  choice.addEventListener("change", translate);
  translate();

  landing.addEventListener("click", event => {
    const card = event.target.closest("button");
    if (!card) return;
    if ("explore" in card.dataset) return leave();
    landing.style.cursor = "progress";
    const language = "titles" in card.dataset && choice.value !== preferred ? `&lang=${choice.value}` : "";
    goTo(card.dataset.place + language, () => {
      if ("titles" in card.dataset) once(lesson, leave);
      else if ("folder" in card.dataset) openFolder(card.dataset.folder);
      else leave();
    });
  });
  window.addEventListener("keydown", escape, true);
  landing.inert = false; // earlier clicks would have no effect
  landing.querySelector("[data-explore]").focus();
})();
