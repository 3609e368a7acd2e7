// The chapters on the page: a table of contents with progress, the current chapter, and the fraction of the page that was read.

import { byId, element } from "../dom.js";
import { isStill } from "./figure.js";

/** @typedef {import("./state.js").Shared} Shared */
/** @typedef {{ link: Element, section: HTMLElement, tasks: Element[], dots: HTMLElement, entry: HTMLElement }} Chapter */

/** The height of the line that the current chapter's title has passed, as a share of the window's height. */
const READING_LINE = 0.4;

/** Fills the table of contents from the links of the navigation. @returns {Chapter[]} */
function buildContents() {
  const host = byId("contents", HTMLElement);
  let list = element("ol");
  return [...document.querySelectorAll("nav > ol > li")].map((item, i) => {
    const link = /** @type {HTMLElement} */ (item.querySelector("a"));
    const part = item.getAttribute("data-part");
    if (part) {
      const box = element("section", "", { "aria-label": part });
      list = element("ol", "", { start: String(i + 1) });
      box.append(element("p", part, { class: "part" }), list);
      host.append(box);
    }
    const href = link.getAttribute("href") || "#";
    const section = byId(href.slice(1), HTMLElement);
    const tasks = [...section.querySelectorAll("[data-exercise], [data-code]")];
    const entry = element("a", "", { href });
    const dots = element("span", "", { class: "dots" });
    entry.append(element("span", section.querySelector("h2")?.textContent || ""), dots);
    const line = element("li");
    line.append(entry);
    list.append(line);
    return { link, section, tasks, dots, entry };
  });
}

/** Shows which exercises of each chapter are solved. @param {Chapter[]} chapters */
function showProgress(chapters) {
  let [solved, all] = [0, 0];
  for (const { link, tasks, dots, entry } of chapters) {
    const done = tasks.filter((task) => task.classList.contains("solved")).length;
    link.classList.toggle("done", tasks.length > 0 && done === tasks.length);
    entry.classList.toggle("done", tasks.length > 0 && done === tasks.length);
    dots.textContent = "●".repeat(done) + "○".repeat(tasks.length - done);
    dots.setAttribute("aria-label", `${done} of ${tasks.length} exercises solved`);
    dots.setAttribute("role", "img");
    solved += done;
    all += tasks.length;
  }
  byId("progress", HTMLElement).textContent = `${solved} of ${all} exercises solved`;
}

/** Closes the table of contents after a choice, a click elsewhere or Escape. @param {HTMLDetailsElement} menu */
function bindMenu(menu) {
  document.addEventListener("click", ({ target }) => {
    const isInside = target instanceof Element && menu.contains(target);
    if (!isInside || (target instanceof Element && target.closest(".contents a"))) menu.open = false;
  });
  menu.addEventListener("keydown", ({ key }) => {
    if (key !== "Escape") return;
    menu.open = false;
    menu.querySelector("summary")?.focus();
  });
}

/** Marks the current chapter, and the fraction of the page that was read. @param {Chapter[]} chapters */
function followScrolling(chapters) {
  const bar = byId("read", HTMLElement);
  let current = -1;
  const follow = () => {
    const { scrollTop, scrollHeight, clientHeight } = document.documentElement;
    bar.style.setProperty("--read", String(scrollTop / (scrollHeight - clientHeight || 1)));
    const below = chapters.findIndex(({ section }) => section.getBoundingClientRect().top > READING_LINE * clientHeight);
    const now = Math.max(0, (below < 0 ? chapters.length : below) - 1);
    if (now === current) return;
    current = now;
    chapters.forEach(({ link }, i) => link.toggleAttribute("aria-current", i === now));
    const { parentElement: item } = chapters[now].link;
    item?.parentElement?.scrollTo({ left: item.offsetLeft - item.parentElement.clientWidth / 2, behavior: isStill() ? "auto" : "smooth" });
  };
  addEventListener("scroll", follow, { passive: true });
  addEventListener("resize", follow);
  follow();
}

/** Table of contents, progress, and the mark of the chapter on screen. @param {Shared} shared */
export function bindNavigation(shared) {
  const chapters = buildContents();
  bindMenu(byId("menu", HTMLDetailsElement));
  followScrolling(chapters);
  let last = -1;
  const show = () => {
    const solved = document.querySelectorAll(".solved").length;
    if (solved !== last) showProgress(chapters);
    last = solved;
  };
  shared.listeners.push(show);
  show();
}
