"""Hold the words of the report on a run: titles, heads of tables and sentences.

``sections`` fills in the numbers.
"""

# What the report says of the method: name -> text with entries of summary.json.
SUMMARY = {
    "scheme": "{scheme}",
    "mass": "{mass}",
    "solver": "{solver}",
    "damping": "{damping}",
    "time step": "{dt} s",
    "steps": "{count}, t = {first} to {last} s",
    "version": "vi_contact {own}, ranks {ranks}",
    "status": "{status}",
    "unknowns": "{unknowns}",
    "contact points": "{contact_points}",
    "iterations a step": "{mean}",
    "worst certificate": "{worst}",
    "energy defect": "{energy_defect}",
}
# Charts of histories: title -> beginnings of columns; of these the first that move.
CHARTS = {
    "thrust, normal force": ("N_", "contact_resultant", "contact_force_"),
    "shear on a part": ("T_",),
    "sliding": ("sliding_", "slip_", "contact_max_slip"),
    "opening": ("opening_",),
    "open share": ("uplift_", "contact_uplift"),
    "length of the crack": ("crack_length",),
    "force of the water in the joint": ("uplift_force",),
    "normal force less that of the water": ("uplift_effective",),
    "pressure at the low end": ("pressure_low_",),
    "pressure at the high end": ("pressure_high_", "contact_max_pressure"),
    "moment": ("M_",),
    "moment of a support": ("reaction_M",),
    "force of a support along x": ("reaction_x_",),
    "force of a support along y": ("reaction_y_",),
    "force of a support along z": ("reaction_z_",),
    "shear force of a section": ("V_",),
    "rocking": ("theta_",),
    "racking": ("racking_",),
    "displacement along x": ("u_x_",),
    "displacement along y": ("u_y_",),
    "displacement along z": ("u_z_",),
}
# Titles where columns of the whole contact stand in the place of those of parts.
CHARTS_OF_THE_WHOLE = {
    "contact_resultant": "contact force",
    "contact_force_": "contact force",
    "contact_max_slip": "largest slip",
    "contact_max_pressure": "largest contact pressure",
}
# Rows of the table of results: what they are called -> beginnings of columns.
RESULTS = {
    "base shear, force of a support": ("reaction_x_", "reaction_y_", "reaction_z_"),
    "moment of a support": ("reaction_M",),
    "thrust, normal force on a part": ("N_",),
    "shear on a part": ("T_",),
    "height of the thrust, when the thrust is largest": ("height_",),
    "height of the thrust over the height of the part, when the thrust is largest": ("level_",),
    "open share": ("contact_uplift", "uplift_"),
    "length of the crack": ("crack_length",),
    "force of the water in the joint": ("uplift_force",),
    "normal force less that of the water": ("uplift_effective",),
    "largest slip": ("contact_max_slip", "slip_"),
    "mean sliding; its end less its start is what remains": ("sliding_",),
    "eccentricity of the thrust from the middle of its part": ("e_",),
    "rocking": ("theta_",),
    "settlement": ("settlement_",),
    "racking": ("racking_",),
    "largest contact pressure": ("contact_max_pressure",),
    "pressure at the end of a part where x, or y, is least": ("pressure_low_",),
    "pressure at the end of a part where x, or y, is largest": ("pressure_high_",),
}
# Heads of tables.
HEADERS = {
    "method": ("method and outcome", ""),
    "results": (
        "result",
        "column",
        "unit",
        "largest in size",
        "at t [s]",
        "at the start",
        "at the end",
    ),
    "safety": ("part", "factor of safety against sliding, smallest", "at t [s]", "at the end"),
    "energies": ("term at the end of the run", "[J]", "over the largest energy"),
    "peaks": ("column", "quantity", "unit", "max", "at t [s]", "min", "at t [s]"),
    "checks": (
        "check",
        "formula",
        "inputs",
        "expected",
        "found",
        "unit",
        "ratio",
        "source",
    ),
}
# Sentences; numbers stand for {names}.
SAY = {
    "untried": (
        "The discretisation error was not measured: `vi-contact report DIR --halved` "
        "repeats the run with half the time step, `--refine` with half the element size too, "
        "and the report says what changes."
    ),
    "refined": (
        "The table has the largest size of every column in this run, and in runs with {finer}. "
        "If the error falls "
        "with the first power of h or dt, the error of this run is twice the difference; "
        "if it falls with the second power, it is 4/3 of the difference."
    ),
    "shaken": "The run was shaken with {peaks}, its scale included, at the time steps of the run.",
    "spectrum": (
        "The spectrum begins at 0.02 s; it is pale where a period has fewer than ten time "
        "steps of the run."
    ),
    "safety": (
        "The factor of safety against sliding is the friction mu N that a part of the "
        "contact could carry, over the shear that it does carry. The law of friction holds "
        "at every point, so the factor never falls below 1; where it is 1 the whole part "
        "slides. Judge overturning by the eccentricity: while it is at most a sixth of the "
        "width, the whole base is pressed; at half the width the base stands on its edge."
    ),
    "accelerations": (
        "Use the low-passed accelerations (Butterworth filter of order 4 without phase "
        "shift, {corner:.3g} Hz). When contact closes, a velocity jumps, and the raw "
        "acceleration of that step is the jump divided by the time step: it grows without "
        "limit as the time step is made shorter. Raw peak accelerations at impacts are not "
        "convergent."
    ),
    "certificate": (
        "Every one of the {steps} steps has a certificate: the largest residual of its "
        "equations and of its contact conditions (no penetration, no pull, pressure at "
        "closed points alone, the law of friction), relative to the numbers of the step. "
        "The worst is {worst:.1e}{asked}."
    ),
    "limits": (
        "So each step was solved. The certificate does not say that mesh and time step are "
        "fine enough, or that materials, supports and motion are those of the structure."
    ),
    "unfinished": "The run has not finished: {why}.",
    "ledger": (
        "The ledger of energies closes: the energy at the start and the input work are "
        "equal to the kinetic energy, the strain energy and the losses below, up to "
        "{defect:.1e} of the largest energy ({most:.4g} J)."
    ),
}
