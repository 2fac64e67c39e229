/** Unpacks the script of the page and starts it: packed it is a third as long. A policy names this loader by its digest. */

import { unpacked } from "./unpacking";

async function start(): Promise<void> {
  const place = document.getElementById("workbench");
  const packed = document.getElementById("workbench-script")?.textContent ?? "";
  if (typeof DecompressionStream !== "function") {
    if (place !== null) place.textContent = "This page needs a newer browser: Chrome 91, Firefox 113, Safari 16.4.";
    return;
  }
  const text = await unpacked(packed);
  const script = document.createElement("script");
  script.src = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  script.onload = () => URL.revokeObjectURL(script.src);
  document.head.append(script);
}

void start();
