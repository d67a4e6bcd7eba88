// A row below the picture, as wide as the page: the common part of the docks at the lower edge.
window.packetmeshDockRow = (() => {
  function make(tag, className, parent, properties = {}) {
    const element = Object.assign(document.createElement(tag), {className, ...properties});
    parent?.append(element);
    return element;
  }

  // Return the page's root: a column whose row holds the picture and the control panel.
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
      // Hide the dock when its hidden panel is missing, for example when the server is gone.
      new MutationObserver(() => this.place()).observe(document.body, {childList: true, subtree: true});
    }

    anchor() {
      return document.querySelector(`.packetmesh-dock[data-dock="${this.name}"]`);
    }

    // Return the element to whose end the row is added.
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
        requestAnimationFrame(() => used?.scrollIntoView({block: "center"})); // the panel has moved down
        this.came?.();
      }
      else {
        this.row.remove();
        this.left?.();
      }
    }
  }

  // Write text for the server into the hidden field of the dock `name`; return false if there is none.
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
