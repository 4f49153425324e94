// A link to a folded part opens it, and on paper all parts are open.
const parts = [...document.querySelectorAll(".part")];
const lead = () => { const part = parts.find(each => "#" + each.id === location.hash); if (part) part.open = true; };
addEventListener("hashchange", lead);
lead();
let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll(".part:not([open]), .gauge:not([open])")];
  for (const part of folded) part.open = true;
});
addEventListener("afterprint", () => { for (const part of folded) part.open = false; });
