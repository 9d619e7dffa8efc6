/** What every page of a running sensor says of the camera and of the moment that is shown. */

import { byId, write } from "./dom";
import type { Moment } from "./ring";

/** Below this many a second, a rate is told to a tenth. */
const SLOW = 100;

export function showCounts(header: Record<string, unknown>): void {
  const { counted, rate, lines, dropped } = header as Record<string, number>;
  const told = rate < SLOW ? rate.toFixed(1) : `${Math.round(rate)}`;
  write(byId("watch-title"), (header.camera as string) || "Live");
  const counts = `${told} ${counted}/s read, ${lines} ${counted}, ${dropped} dropped`;
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
