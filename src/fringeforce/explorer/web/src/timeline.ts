/** What the person decided, step by step, so that it can be taken back. */

const HISTORY = 200;

export class Timeline<S extends object> {
  private committed: S;
  private past: S[] = [];
  private future: S[] = [];

  constructor(
    public state: S,
    private readonly onChange: (before: S) => void,
  ) {
    this.committed = state;
  }

  get canUndo(): boolean {
    return this.past.length > 0;
  }

  get canRedo(): boolean {
    return this.future.length > 0;
  }

  /** Change something; a gesture commits only when it ends, so that undo takes it back whole. */
  change(part: Partial<S>, commit = true): void {
    const before = this.state;
    this.state = { ...before, ...part };
    if (commit) this.commit();
    this.onChange(before);
  }

  commit(): void {
    if (JSON.stringify(this.committed) === JSON.stringify(this.state)) return;
    this.past = [...this.past.slice(1 - HISTORY), this.committed];
    this.future = [];
    this.committed = this.state;
  }

  /** Follow from the server, such as another number of tactels: no step of its own in history. */
  amend(part: Partial<S>): void {
    this.state = { ...this.state, ...part };
    this.committed = this.state;
  }

  undo(): void {
    this.travel(this.past, this.future);
  }

  redo(): void {
    this.travel(this.future, this.past);
  }

  private travel(from: S[], to: S[]): void {
    const target = from.pop();
    if (!target) return;
    const before = this.state;
    to.push(this.committed);
    this.state = this.committed = target;
    this.onChange(before);
  }
}
