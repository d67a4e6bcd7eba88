// Somebody of a class: what stands over the picture, their votes, and whether the view is the teacher's or their own.
window.packetmeshLecture ??= (() => {
  const REFUSED_MS = 4000;
  const EDGE_PX = 16; // between the chip and the picture's edges
  let name = null; // of the seat's hidden field
  let said = 0;
  let refused = 0; // the timer until it is forgotten
  const state = {follows: true, steers: false, asks: false, vote: 0};

  function make(tag, parent, properties = {}) {
    return parent.appendChild(Object.assign(document.createElement(tag), properties));
  }

  const chip = Object.assign(document.createElement("div"), {className: "packetmesh-seat"});
  const ballot = make("span", chip, {className: "packetmesh-ballot", textContent: "Your vote"});
  const votes = [1, 2, 3].map(vote => make("button", ballot, {textContent: vote, onclick: () => cast(vote)}));
  const text = make("span", chip);
  const back = make("button", chip, {textContent: "Back to the class", onclick: () => follow(true)});
  const resized = new ResizeObserver(place);

  function say(word) {
    if (!window.packetmeshDockRow.write(name, `${said + 1} ${word}`)) return void setTimeout(say, 100, word);
    said += 1;
  }

  function follow(follows) {
    if (state.follows === follows) return;
    state.follows = follows;
    draw();
    say(follows ? "follow" : "roam");
  }

  function cast(vote) {
    state.vote = vote;
    draw();
    say(`vote ${vote}`);
  }

  function draw() {
    const view = state.follows ? "You see what the teacher sees; drag to look around." : "You look around on your own.";
    text.textContent = refused ? "The teacher steers; drag the picture to look around." : state.steers ? `${view} You may steer.` : view;
    chip.classList.toggle("packetmesh-refused", refused > 0);
    ballot.hidden = !state.asks;
    votes.forEach((button, index) => button.setAttribute("aria-pressed", index + 1 === state.vote));
    back.hidden = state.follows;
    place();
  }

  function place() {
    const canvas = document.querySelector("canvas[data-engine]");
    if (!canvas) return void setTimeout(place, 200);
    resized.observe(canvas);
    const {left, bottom, width} = canvas.getBoundingClientRect();
    Object.assign(chip.style, {
      left: `${left + EDGE_PX}px`, bottom: `${innerHeight - bottom + EDGE_PX}px`, maxWidth: `${width - 2 * EDGE_PX}px`,
    });
    if (!chip.isConnected) document.body.append(chip);
  }

  // A hand on the picture turns the own view.
  const roam = event => event.target.matches?.("canvas[data-engine]") && follow(false);
  window.addEventListener("wheel", roam, {capture: true, passive: true});
  window.addEventListener("pointermove", event => event.buttons && roam(event), true);
  window.addEventListener("resize", place);

  // Before the lesson's own keys, which are the teacher's.
  window.addEventListener("keydown", event => {
    const vote = [1, 2, 3].find(one => String(one) === event.key);
    if (!vote || !state.asks || event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input, textarea")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    cast(vote);
  }, true);

  return {
    begin(seat) {
      name = seat;
      draw();
    },

    show(now) {
      Object.assign(state, now);
      draw();
    },

    // What was touched is not theirs.
    refuse() {
      clearTimeout(refused);
      refused = setTimeout(() => { refused = 0; draw(); }, REFUSED_MS);
      draw();
    },
  };
})();
