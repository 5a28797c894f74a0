"""Small faults put into the exported text; each must be noticed by the comparison with the host."""

MUTANTS = (
    ("windowOutput[1] := heldOutput - meanOutput", "windowOutput[1] := heldOutput"),
    ("(contamination > UNTRUSTED)", "(contamination > 2.0 * UNTRUSTED)"),
    ("FOR i := NTAPS TO 2 BY -1", "FOR i := NTAPS TO 3 BY -1"),
    ("IF spoilt > 0 THEN", "IF spoilt > 1 THEN"),
    ("heldCount := heldCount - 1", "heldCount := 0"),
    ("IF ABS(speed) > peak THEN", "IF speed > peak THEN"),
    ("heldCount := NK + NB", "heldCount := NK"),
    ("phi[NA + j] := pastIn[NK + j]", "phi[NA + j] := pastIn[j]"),
    ("phi[i] := -pastOut[i]", "phi[i] := pastOut[i]"),
    ("IF usedCount < START_UP", "IF usedCount <= START_UP"),
    ("ePost := ePrior / (1.0 + gainF.quad)", "ePost := ePrior / (2.0 + gainF.quad)"),
    ("facV[i, j] := element - product[i] * share", "facV[i, j] := element - product[j] * share"),
    ("facE[j] := facE[j] * (before * weight)", "facE[j] := facE[j] * before * weight"),
    ("before := alpha", "before := lambda1Now"),
    ("scale := traceHeld / traceF", "scale := 1.0"),
    ("(mirror > -1.0) AND (mirror < 1.0)", "(mirror > -1.0)"),
    ("(mirror > -1.0) AND (mirror < 1.0)", "(mirror < 1.0)"),
    ("IF stable AND ADAPT_FILTER", "IF ADAPT_FILTER"),
    ("FOR i := 1 TO m / 2 DO", "FOR i := 1 TO (m - 1) / 2 DO"),
    ("torque := torqueM1 + torqueM2", "torque := torqueM1"),
)
"""What stands in the text, and what is put in its place."""
