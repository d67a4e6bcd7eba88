// A student's page: messages for the student, votes, and whether the view is the teacher's or the student's.
window.packetmeshLecture = (() => {
  const REFUSED_MS = 4000;
  const VOTER = "packetmesh-voter"; // key of the browser's id
  const bytes = [...crypto.getRandomValues(new Uint8Array(16))];
  const fresh = bytes.map(byte => byte.toString(16).padStart(2, "0")).join(""); // id of a browser that has none
  let name = null; // name of the seat's hidden field
  let said = 0;
  let refused = 0; // timer that removes the refusal message
  const state = {follows: true, steers: false, asks: false, vote: 0};

  function make(tag, parent, properties = {}) {
    return parent.appendChild(Object.assign(document.createElement(tag), properties));
  }

  const chip = Object.assign(document.createElement("div"), {className: "packetmesh-seat"});
  const text = make("span", chip);
  const back = make("button", chip, {textContent: "Back to the class", onclick: () => follow(true)});

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

  // The browser's random id, which it keeps: a student who reloads the page still has one vote. Where the
  // browser's storage is blocked, the id lasts as long as the page.
  function voter() {
    try {
      if (localStorage.getItem(VOTER) === null) localStorage.setItem(VOTER, fresh);
      return localStorage.getItem(VOTER);
    } catch {
      return fresh;
    }
  }

  // Take a choice in the lesson as a vote. Returns false if no vote is open.
  function cast(vote) {
    if (!state.asks || ![1, 2, 3].includes(vote)) return false;
    state.vote = vote;
    draw();
    say(`vote ${vote} ${voter()}`);
    return true;
  }

  function draw() {
    const view = state.follows ? "You see what the teacher sees; drag to look around." : "You look around on your own.";
    text.textContent = refused ? "The teacher steers; drag the picture to look around." : state.steers ? `${view} You may steer.` : view;
    chip.classList.toggle("packetmesh-refused", refused > 0);
    back.hidden = state.follows;
    document.documentElement.classList.toggle("packetmesh-seated", !state.steers);
    window.packetmeshLesson.show();
    place();
  }

  function place() {
    const home = window.packetmeshDockRow.root();
    if (!home) return void setTimeout(place, 200);
    if (!chip.isConnected) home.append(chip);
  }

  // Dragging or scrolling the picture gives the student an own view.
  const roam = event => name !== null && event.target.matches?.("canvas[data-engine]") && follow(false);
  window.addEventListener("wheel", roam, {capture: true, passive: true});
  window.addEventListener("pointermove", event => event.buttons && roam(event), true);

  return {
    vote: cast,

    // The student's vote while a question is open, else 0.
    get voted() {
      return state.asks ? state.vote : 0;
    },

    begin(seat) {
      name = seat;
      draw();
    },

    show(now) {
      Object.assign(state, now);
      draw();
    },

    // Show that the touched control belongs to the teacher.
    refuse() {
      clearTimeout(refused);
      refused = setTimeout(() => { refused = 0; draw(); }, REFUSED_MS);
      draw();
    },
  };
})();
packetmesh.calls.beginSeat = (_, seat) => packetmeshLecture.begin(seat);
packetmesh.calls.showSeat = (_, state) => packetmeshLecture.show(state);
packetmesh.calls.refuse = () => packetmeshLecture.refuse();
