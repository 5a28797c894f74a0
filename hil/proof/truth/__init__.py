"""The truth simulator: a driveline that shares no line and no formulation with the model that is fitted.

=====================  =======================================================================
what                   how it is done here
=====================  =======================================================================
dry friction           LuGre bristles with a state of their own, so a mass can really stick
backlash               two one-sided contacts with stiffness and damping; a contact never pulls
nonlinear shaft        sinh and asinh characteristics
hysteresis             Iwan's row of Jenkins elements
Cardan joint           its kinematics, between two ends that both feel it
extra mode             one more inertia in line, before or behind the shaft
tyre                   magic formula with relaxation length; wheels and vehicle apart
generator              inertia of its own behind a slipping clutch (Moreau's time stepping)
warming, derating      viscosity falls exponentially with temperature; each inverter's own torque
events                 ramps at drawn moments, which may be missing in one recording
inverter's torque      state of a first-order current loop, integrated exactly; limits with a knee
transport delay        first in, first out, switched at the very moment and not at a sample
road grade             height profile over the distance driven
speed filter           recursion at the inverter's cycle of 0.1 ms
sampling               at its true instants in continuous time, of jitter and of two clocks
integration            Strang splitting: exact drift, bristles and relaxations; damped kick
=====================  =======================================================================

Effects are joined in one driveline (``physics``), then in what is read (``readings``: curvature, noise, lost sign,
number format), then in what is recorded (``rows``: wrong bits, repeats, losses). That order is fixed.

It imports nothing of ``estimator``; an import contract keeps it so.
"""
