/** The line of a channel on a plot: no more points than can be told apart, in the order in which they come. */

import type uPlot from "../vendor/uplot/uPlot.esm.js";

/** Pixels of the canvas by which a point may be off what is drawn. */
const FINEST = 0.25;
/** uPlot's number for a path that is clipped to the plot. */
const CLIPPED = 1;

/** Draws series; `isHeld` where a value stays until the next one. */
export function pathsOf(isHeld: boolean): uPlot.Series.PathBuilder {
  return (plot, series) => {
    const stroke = lineOn(plot, plot.data[0] as Float64Array, plot.data[series] as Float64Array, isHeld);
    return { stroke, fill: null, clip: null, band: null, gaps: [], flags: CLIPPED };
  };
}

/** The line of samples in the units of a plot; those that are no number leave a gap. */
export function lineOn(plot: uPlot, times: Float64Array, values: Float64Array, isHeld: boolean): Path2D {
  const { left, top, width, height } = plot.bbox;
  const [x, y] = [plot.scales["x"], plot.scales["y"]];
  const across = width / ((x?.max ?? 1) - (x?.min ?? 0));
  const up = height / ((y?.max ?? 1) - (y?.min ?? 0));
  const path = new Path2D();
  const pen = new Pen(path, isHeld);
  for (let place = 0; place < times.length; place += 1) {
    const value = values[place] ?? NaN;
    if (Number.isNaN(value)) pen.lift();
    else pen.put(left + ((times[place] ?? 0) - (x?.min ?? 0)) * across, top + height - (value - (y?.min ?? 0)) * up);
  }
  pen.lift();
  return path;
}

/** Draws from point to point, and leaves out those on the way where a line goes on level, or up and down within a pixel. */
class Pen {
  private isDown = false;
  private x = 0;
  private y = 0;
  /** The last point that was put and not drawn yet, and how far those since the last drawn one went. */
  private lastX = 0;
  private lastY = 0;
  private low = 0;
  private high = 0;

  constructor(
    private readonly path: Path2D,
    private readonly isHeld: boolean,
  ) {}

  put(x: number, y: number): void {
    if (!this.isDown) {
      this.path.moveTo(x, y);
      this.isDown = true;
      this.begin(x, y);
    } else if (Math.max(this.high, y) - Math.min(this.low, y) < FINEST || x - this.x < 1) {
      this.low = Math.min(this.low, y);
      this.high = Math.max(this.high, y);
    } else {
      this.draw();
      this.begin(this.lastX, this.lastY);
      if (this.isHeld) this.step(x, y);
      this.low = Math.min(this.low, y);
      this.high = Math.max(this.high, y);
    }
    this.lastX = x;
    this.lastY = y;
  }

  /** Draw what is left, and begin anew with the next point. */
  lift(): void {
    if (this.isDown) this.draw();
    this.isDown = false;
  }

  private begin(x: number, y: number): void {
    this.x = x;
    this.y = y;
    this.low = y;
    this.high = y;
  }

  private step(x: number, y: number): void {
    this.path.lineTo(x, this.lastY);
    this.path.lineTo(x, y);
    this.begin(x, y);
  }

  /** To the last point, by way of the farthest ones since the last drawn. */
  private draw(): void {
    const isLevel = this.high - this.low < FINEST;
    if (!isLevel && this.low < Math.min(this.y, this.lastY)) this.path.lineTo(this.lastX, this.low);
    if (!isLevel && this.high > Math.max(this.y, this.lastY)) this.path.lineTo(this.lastX, this.high);
    this.path.lineTo(this.lastX, this.lastY);
  }
}
