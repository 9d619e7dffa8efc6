/** What every page of a running sensor says of the camera and of the moment that is shown. */

import { byId, write } from "./dom";
import type { Moment } from "./ring";

/** Below this many a second, a rate is told to a tenth. */
const SLOW = 100;

export function showCounts(header: Record<string, unknown>): void {
  const counted = header.counted as string;
  const { rate, lines, dropped } = header as Record<string, number>;
  const told = rate < SLOW ? rate.toFixed(1) : `${Math.round(rate)}`;
  write(byId("watch-title"), (header.camera as string) || "Live");
  const read = lines === 1 ? counted.slice(0, -1) : counted; // "1 image", but "2 images"
  const counts = `${told} ${counted}/s read, ${lines} ${read}, ${dropped} dropped`;
  write(byId("watch-counts"), lines ? counts : "");
  const trouble = (header.ended as string) || (header.trouble as string);
  write(byId("watch-trouble"), trouble);
  byId("watch-trouble").hidden = !trouble;
}

export function showMoment(moment: Moment): void {
  write(byId("watch-status"), moment.status.replaceAll("_", " "));
  byId("watch-status").dataset.status = moment.status;
  write(byId("watch-advice"), moment.advice);
}
