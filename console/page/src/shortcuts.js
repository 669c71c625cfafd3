// Every key of the page; `?` shows them.

const TABS = ["world", "network", "machines", "plots", "log"];

/**
 * @param {object} parts
 * @param {import("./store.js").Store} parts.store
 * @param {import("./control.js").Control} parts.control
 * @param {import("./timeline.js").Timeline} parts.timeline
 * @param {import("./layout.js").Layout} parts.layout
 * @param {import("./view_bar.js").ViewBar} parts.bar
 * @param {() => void} parts.home
 * @param {() => void} parts.send
 * @param {() => void} parts.pick
 * @returns {import("./layout.js").Shortcut[]}
 */
export function shortcutsOf({ store, control, timeline, layout, bar, home, send, pick }) {
  /** @type {(keys: string, text: string, act: (event: KeyboardEvent) => void, names?: string[]) => import("./layout.js").Shortcut} */
  const on = (shown, text, act, names = [shown]) => ({ keys: names, shown, text, act });
  return [
    on("Space", "pause or resume", () => control.toggle(), [" "]),
    on(".", "one tick on", () => control.stepBy(1)),
    on("Shift + .", "several ticks", () => void control.askSteps(), [":", ">"]),
    on("[ ]", "slower, faster", (event) => control.changePace(event.key === "]" ? 1 : -1), ["[", "]"]),
    on("← →", "one frame back or on (captures)", (event) => timeline.by(event.key === "ArrowLeft" ? -1 : 1), ["ArrowLeft", "ArrowRight"]),
    on("Shift + ← →", "a second back or on (captures)", (event) => timeline.bySeconds(event.key === "ArrowLeft" ? -1 : 1), ["Shift+ArrowLeft", "Shift+ArrowRight"]),
    on("n", "names", () => bar.toggle("labels")),
    on("o", "colours by owner", () => bar.toggle("owners")),
    on("p", "paths", () => bar.toggle("paths")),
    on("c", "contacts", () => bar.toggle("contacts")),
    on("r", "rays of sensors", () => bar.toggle("rays")),
    on("l", "radio links", () => bar.toggle("radio")),
    on("f", "follow the selected entity", () => bar.toggle("follow")),
    on("g", "send the selected robot where one clicks next", send),
    on("Home", "the whole world", home),
    on("1 – 5", "World, Network, Machines, Plots, Log", (event) => layout.show(TABS[Number(event.key) - 1]), ["1", "2", "3", "4", "5"]),
    on("v", "pick a value to plot", pick),
    on("t", "light, dark, as the system", () => layout.nextTheme()),
    on("Esc", "send nobody, select nothing", () => {
      if (store.aim) {
        store.aimWith("");
        return;
      }
      store.select("");
      store.selectLink(null);
    }, ["Escape"]),
    on("?", "this help", () => layout.help()),
  ];
}
