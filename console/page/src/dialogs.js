// Dialogs: a form that asks, a question before something ends. The browser's own <dialog> keeps the focus in it.

import { button, h } from "./ui.js";

const PATIENCE_MS = 1500;

/**
 * Show a dialog; resolves to true when its form is sent, to false when it is closed.
 * `send` may refuse by a text, which the dialog shows, and stays open; one that takes long is not waited for.
 * @param {string} title
 * @param {(Node | string)[]} content
 * @param {{action: string, danger?: boolean, wide?: boolean, send?: () => (string | void | Promise<string | void>)}} how
 * @returns {Promise<boolean>}
 */
export function dialog(title, content, how) {
  return new Promise((resolve) => {
    const wrong = h("p", { class: "wrong", role: "alert" });
    const send = h("button", { type: "submit", class: how.danger ? "danger" : "primary" }, how.action);
    const form = h(
      "form",
      { method: "dialog" },
      h("h2", {}, title),
      ...content,
      wrong,
      h("div", { class: "actions" }, button("Cancel", () => box.close("")), send),
    );
    const box = h("dialog", { class: how.wide ? "wide" : "", "aria-label": title }, form);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      send.disabled = true;
      wrong.textContent = "";
      // A paused run answers some requests when it goes on: the page stays usable meanwhile, the log has the answer.
      const text = await Promise.race([how.send?.(), new Promise((later) => window.setTimeout(() => later(""), PATIENCE_MS))]);
      send.disabled = false;
      if (text) wrong.textContent = text;
      else box.close("sent");
    });
    box.addEventListener("close", () => {
      box.remove();
      resolve(box.returnValue === "sent");
    });
    document.body.append(box);
    box.showModal();
  });
}

/**
 * Ask before something that ends or cuts.
 * @param {string} title
 * @param {string} text
 * @param {string} action what the button says
 */
export function confirmed(title, text, action) {
  return dialog(title, [h("p", {}, text)], { action, danger: true });
}

/**
 * Show a text to read, or to copy.
 * @param {string} title
 * @param {(Node | string)[]} content
 */
export function shown(title, content) {
  const box = h(
    "dialog",
    { class: "wide", "aria-label": title },
    h("form", { method: "dialog" }, h("h2", {}, title), ...content, h("div", { class: "actions" }, h("button", { class: "primary", autofocus: true }, "Close"))),
  );
  box.addEventListener("close", () => box.remove());
  document.body.append(box);
  box.showModal();
}

/**
 * Three numbers of a vector, or the text of what is wrong.
 * @param {string} text such as `0.1 0 -2`
 * @param {string} what
 * @returns {Vec3 | string}
 */
export function vector(text, what) {
  const parts = text.trim().split(/[\s,;]+/).map(Number);
  if (parts.length !== 3 || parts.some((part) => !Number.isFinite(part))) return `${what}: three numbers are needed, for example 0.1 0 0`;
  return [parts[0], parts[1], parts[2]];
}
