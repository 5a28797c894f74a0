"""The truth simulator: a driveline that shares no line and no formulation with the model that is fitted.

=====================  =======================================================================
what                   how it is done here
=====================  =======================================================================
dry friction           LuGre bristles with a state of their own, so a mass can really stick
backlash               two one-sided contacts with stiffness and damping; a contact never pulls
nonlinear shaft        sinh and asinh characteristics
inverter's torque      state of a first-order current loop, integrated exactly
transport delay        first in, first out, switched at the very moment and not at a sample
road grade             height profile over the distance driven
integration            Strang splitting: exact drift, bristles and relaxations; damped kick
=====================  =======================================================================

It imports nothing of ``estimator``; an import contract keeps it so.
"""
