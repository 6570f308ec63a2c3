// Colours. Vermilion, blue and grey, with viridis for times: distinct for the colour-blind.

export interface Theme {
  paper: string;
  ink: string;
  faint: string;
  grid: string;
  neutral: string;
  robot: string;
  goal: string;
  halo: string;
  blocked: string;
  /** Of what a sentence names or the pointer is on. */
  mark: string;
}

export const LIGHT: Theme = {
  paper: "#ffffff",
  ink: "#1c1f24",
  faint: "#5c626d",
  grid: "#e9ebef",
  neutral: "#c9ccd2",
  robot: "#d55e00",
  goal: "#0072b2",
  halo: "#ffffff",
  blocked: "#1c1f24",
  mark: "#b3308a",
};

export const DARK: Theme = {
  paper: "#16181d",
  ink: "#e8eaee",
  faint: "#9aa0ab",
  grid: "#2f343e",
  neutral: "#5b616c",
  robot: "#ff8a3d",
  goal: "#56b4e9",
  halo: "#16181d",
  blocked: "#e8eaee",
  mark: "#f08fd0",
};

const VIRIDIS = [
  [68, 1, 84],
  [72, 36, 117],
  [65, 68, 135],
  [53, 95, 141],
  [42, 120, 142],
  [33, 145, 140],
  [34, 168, 132],
  [68, 191, 112],
  [122, 209, 81],
  [189, 223, 38],
  [253, 231, 37],
] as const;

/** Colour of a share from 0 to 1; earlier is darker on a light page and lighter on a dark one. */
export function viridis(share: number, theme: Theme): [number, number, number] {
  const x = Math.min(1, Math.max(0, theme === DARK ? 1 - share : share)) * (VIRIDIS.length - 1);
  const k = Math.min(VIRIDIS.length - 2, Math.floor(x));
  const a = VIRIDIS[k]!;
  const b = VIRIDIS[k + 1]!;
  return [0, 1, 2].map((c) => Math.round(a[c]! + (x - k) * (b[c]! - a[c]!))) as [number, number, number];
}

export function css([r, g, b]: readonly number[], opacity = 1): string {
  return `rgba(${r},${g},${b},${opacity})`;
}

/** Colours of outcomes in fleets, from undisturbed to fallbacks (Okabe and Ito). */
export const OUTCOMES: Record<string, { colour: string; label: string }> = {
  CLEAR: { colour: "#56b4e9", label: "as preferred" },
  KEPT: { colour: "#0072b2", label: "manoeuvre kept" },
  CONSTRAINED: { colour: "#e69f00", label: "avoiding" },
  CONTINUED: { colour: "#cc79a7", label: "continued" },
  INTERRUPTED: { colour: "#cc79a7", label: "continued" },
  BEGUN: { colour: "#cc79a7", label: "continued" },
  SQUEEZED: { colour: "#d55e00", label: "fallback" },
  LIKELY: { colour: "#d55e00", label: "fallback" },
  DEVIATING: { colour: "#e69f00", label: "avoiding" },
  STOPPING: { colour: "#d55e00", label: "fallback" },
  DELAYED: { colour: "#d55e00", label: "fallback" },
  BRAKING: { colour: "#d55e00", label: "fallback" },
  IMPACT: { colour: "#d55e00", label: "fallback" },
  INADMISSIBLE: { colour: "#d55e00", label: "fallback" },
  ESCAPING: { colour: "#d55e00", label: "fallback" },
  CHOSEN: { colour: "#56b4e9", label: "as preferred" },
  UNANSWERED: { colour: "#d55e00", label: "fallback" },
};
