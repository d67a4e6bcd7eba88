// A row of its own below the picture, as wide as the page: what the docks at the lower edge have in common.
window.packetmeshDockRow = (() => {
  function make(tag, className, parent, properties = {}) {
    const element = Object.assign(document.createElement(tag), {className, ...properties});
    parent?.append(element);
    return element;
  }

  // The page's root is a column with the picture and the control panel in its row.
  function root() {
    let found = null;
    for (let element = document.querySelector("canvas[data-engine]"); element; element = element.parentElement)
      if (element.style.flexDirection === "column" && element.style.height === "100%") found = element;
    return found;
  }

  class DockRow {
    constructor(name, label) {
      this.name = name;
      this.wanted = this.visible = false;
      this.row = make("div", "packetmesh-dock-row", null, {tabIndex: 0, role: "group", ariaLabel: label});
      // Without the panel through which it speaks, as when the server is gone, it is not there.
      new MutationObserver(() => this.place()).observe(document.body, {childList: true, subtree: true});
    }

    anchor() {
      return document.querySelector(`.packetmesh-dock[data-dock="${this.name}"]`);
    }

    // What it is put into, behind all else there.
    home() {
      return root();
    }

    place() {
      const visible = Boolean(this.wanted && this.anchor());
      if (visible === this.visible && (!visible || this.row.isConnected)) return;
      this.visible = visible;
      if (visible) {
        const used = document.activeElement;
        this.home()?.append(this.row);
        requestAnimationFrame(() => used?.scrollIntoView({block: "center"})); // the panel is lower now
        this.came?.();
      }
      else {
        this.row.remove();
        this.left?.();
      }
    }
  }

  // The way to the server: the hidden text field beside the anchor of that name; false if it is not there.
  function write(name, text) {
    const anchor = document.querySelector(`.packetmesh-dock[data-dock="${name}"]`);
    const input = anchor?.parentElement.nextElementSibling?.querySelector("input");
    if (!input) return false;
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(input, text);
    input.dispatchEvent(new Event("input", {bubbles: true}));
    return true;
  }

  return {DockRow, make, root, write};
})();
