// The board over a race: names, large numbers and the scale of colours. Its other side is board.py.
(() => {
  if (window.packetmeshBoards?.made) return;

  const boards = new Map();
  const {DockRow, make} = window.packetmeshDockRow;

  class Board extends DockRow {
    constructor(name) {
      super(name, "Race");
      this.row.className = "packetmesh-board";
      this.row.removeAttribute("tabindex");
      this.lanes = [];
      this.scores = [];
    }

    // It lies over the picture.
    home() {
      return document.querySelector("canvas[data-engine]")?.parentElement.parentElement;
    }

    setup({visible, top, lanes, scale}) {
      this.wanted = visible;
      this.row.replaceChildren();
      this.row.style.setProperty("--lanes", Math.max(lanes.length, 1));
      this.row.style.setProperty("--top", `${100 * top}%`);
      this.lanes = lanes.map(lane => this.addLane(lane));
      const legend = make("div", "scale", this.row);
      make("span", "", legend, {textContent: scale.text});
      make("span", "", legend, {textContent: scale.ends[0]});
      make("i", "", legend).style.background = `linear-gradient(to right, ${scale.stops.join(", ")})`;
      make("span", "", legend, {textContent: scale.ends[1]});
      make("b", "", legend);
      make("span", "", legend, {textContent: scale.target});
      this.state({lanes: this.scores});
    }

    addLane({name, color, about, source}) {
      const lane = make("div", "lane", this.row);
      lane.style.setProperty("--color", color);
      const head = make("div", "head", lane);
      const title = make("div", "title", head);
      make("span", "", title, {textContent: name});
      const ask = make("button", "", title, {textContent: "?", type: "button", ariaLabel: `What ${name} does`});
      const number = make("div", "number", head);
      const value = make("b", "", number);
      const unit = make("span", "", number);
      const note = make("div", "note", head);
      const answer = make("div", "answer", head, {hidden: true});
      make("p", "", answer, {textContent: about});
      make("p", "source", answer, {textContent: source});
      ask.addEventListener("click", () => { answer.hidden = !answer.hidden; });
      return {head, value, unit, note};
    }

    state({lanes}) {
      this.scores = lanes;
      this.lanes.forEach((lane, index) => {
        const said = lanes[index];
        if (!said) return;
        lane.value.textContent = said.number;
        lane.unit.textContent = said.unit;
        lane.note.textContent = said.note;
        lane.head.dataset.state = said.state;
      });
    }
  }

  const waiting = window.packetmeshBoards ?? [];
  window.packetmeshBoards = {
    made: true,
    push(message) {
      if (!boards.has(message.dock)) boards.set(message.dock, new Board(message.dock));
      const board = boards.get(message.dock);
      board[message.kind](message);
      board.place();
    },
  };
  waiting.forEach(message => window.packetmeshBoards.push(message));
})();
