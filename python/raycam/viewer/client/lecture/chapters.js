// The chapters on the page: a table of contents with progress, the chapter on screen, and how much of the page was read.

import { byId, element } from "../dom.js";
import { isStill } from "./figure.js";

/** @typedef {import("./state.js").Shared} Shared */
/** @typedef {{ link: Element, section: HTMLElement, tasks: Element[], dots: HTMLElement, entry: HTMLElement }} Chapter */

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

/** Marks the chapter on screen. @param {Chapter[]} chapters */
function followChapters(chapters) {
  const observer = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const found = chapters.find(({ section }) => section === target);
      if (!found || !isIntersecting) continue;
      for (const { link } of chapters) link.toggleAttribute("aria-current", link === found.link);
      const { parentElement: item } = found.link;
      item?.parentElement?.scrollTo({ left: item.offsetLeft - item.parentElement.clientWidth / 2, behavior: isStill() ? "auto" : "smooth" });
    }
  }, { rootMargin: "-30% 0px -60% 0px" });
  for (const { section } of chapters) observer.observe(section);
}

/** Table of contents, progress, and the mark of the chapter on screen. @param {Shared} shared */
export function bindNavigation(shared) {
  const chapters = buildContents();
  bindMenu(byId("menu", HTMLDetailsElement));
  followChapters(chapters);
  let last = -1;
  const show = () => {
    const solved = document.querySelectorAll(".solved").length;
    if (solved !== last) showProgress(chapters);
    last = solved;
  };
  shared.listeners.push(show);
  show();
  const bar = byId("read", HTMLElement);
  const read = () => {
    const { scrollTop, scrollHeight, clientHeight } = document.documentElement;
    bar.style.setProperty("--read", String(scrollTop / (scrollHeight - clientHeight || 1)));
  };
  addEventListener("scroll", read, { passive: true });
  read();
}
