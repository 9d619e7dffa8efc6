/** One scale along the strip for all pictures, so that they stand exactly below each other. */

export const LEFT = 52;
export const RIGHT = 14;

export interface Layout {
  /** Width of a panel's content [px]. */
  width: number;
  /** Pixels per metre, along the strip and through its depth. */
  scale: number;
  /** Where a place along the strip is drawn [px]. */
  across: (x: number) => number;
}

export function layout(width: number, length: number): Layout {
  const scale = (width - LEFT - RIGHT) / length;
  return { width, scale, across: (x) => LEFT + (x + length / 2) * scale };
}

/** Which pictures are on the screen, so that those that are not cost nothing. */
export class Sight {
  private readonly away = new Set<Element>();
  private readonly observer: IntersectionObserver;

  constructor(onSeen: () => void) {
    const margin = { rootMargin: "120px" };
    this.observer = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        if (isIntersecting) this.away.delete(target);
        else this.away.add(target);
      }
      if (entries.some((entry) => entry.isIntersecting)) onSeen();
    }, margin);
  }

  sees(element: Element): boolean {
    return !this.away.has(element);
  }

  watch(...elements: Element[]): void {
    for (const element of elements) this.observer.observe(element);
  }
}
