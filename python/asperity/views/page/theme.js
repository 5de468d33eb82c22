// The switch between light and dark: as the system says, light, dark. The browser remembers the choice.

/** Show the switch, and set the page to the last choice. */
function themeSwitch() {
  const button = document.getElementById("theme");
  const names = {auto: "◐ as the system", light: "☀ light", dark: "☾ dark"};
  const set = (theme) => {
    if (theme === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = theme;
    button.textContent = names[theme];
    button.dataset.theme = theme;
    try { localStorage.setItem("asperity-theme", theme); } catch { /* a page of a file may not */ }
  };
  let theme = "auto";
  try { theme = localStorage.getItem("asperity-theme") || "auto"; } catch { /* likewise */ }
  set(theme in names ? theme : "auto");
  button.hidden = false;
  button.addEventListener("click", () => {
    const order = Object.keys(names);
    set(order[(order.indexOf(button.dataset.theme) + 1) % order.length]);
  });
}
