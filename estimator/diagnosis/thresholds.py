"""Thresholds: every number that decides what a diagnosis refuses, tries, believes and says, in the order of its course.

With each stands what it is for and where it is from. Those that were counted, or that the contract gives, are in
``thresholds.toml`` with the command that counted them. Where neither a source nor a command is given, the number is a
choice: its reason is given, and no campaign has counted it. Steps of a numerical method, and what fits into memory,
stand with their method; what is usual before a recording is seen, in `priors.py`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

THRESHOLDS_FILE = Path(__file__).parent / "thresholds.toml"

THRESHOLDS: Mapping[str, Any] = tomllib.loads(THRESHOLDS_FILE.read_text(encoding="utf-8"))
"""Those that were counted, by name."""


class Recordings:
    """Recordings before anything is asked of them (`preconditions/prepare.py`)."""

    # Samples in a row that count: by chance two in three of the steps between them would have to be alike
    FEWEST_IN_A_ROW = 20
    # How far three samples of a straight line may be off one, in the file's least steps: each is rounded by half of
    # one, and the middle one counts twice
    ROUNDING = 2.0
    SMOOTH = 1e-9  # the same as a share of the signal's range, where a file has all digits
    # How far three samples usually are off a straight line, in what rounding makes of one: below, it can't be decided.
    # The line itself must go further than that: a motion that settles without noise is straight in the end.
    BENT = 50.0
    SELDOM = 0.05  # share of equal neighbours elsewhere up to which twenty in a row are no chance: 1e-26
    # Samples of all recordings, counted once for each recording: 12 of 3000 samples. A fit takes some 1.4 kB for each.
    MOST_SAMPLES_TIMES_RECORDINGS = 500_000
    LONGEST_S = 0.01  # from sample to sample, of a line that no faster mode asks more of
    # The same where a likelihood of the samples is formed: on a millisecond's grid only an encoder's steps are seen
    LONGEST_OF_RIGID_S = 0.02
    # Share of the power of what a joint takes that lies within its band: a joint has no mode, its motion is imposed
    BAND_POWER = 0.99
    # Samples of the shortest recording that are kept in any case: fewer do not carry a model with a dozen unknowns
    FEWEST_KEPT = 200
    PER_PERIOD = 12.0  # samples kept per period of the line's fastest mode, at least; and one in `LONGEST_S`
    FEWEST_SAMPLES = 200  # fewer good samples than this do not carry a model with a dozen unknowns and its hold-out
    # From this share of the first natural frequency on a line answers otherwise than one body: by ``1 / (1 - 0.7^2)``,
    # twice as much
    NEAR_MODE = 0.7


class Segments:
    """Where a recording is cut (`segments.py`)."""

    LONG_S = 1.0  # a gap that is longer ends a segment
    LONG_SAMPLES = 10  # it must also hold more samples than this: where sampling is slow, a few lost ones are no gap
    # Good samples of a segment must cover this: less can't tell its initial state and its load from all else
    SHORTEST_S = 2.0
    # Good samples of a segment at least: more than twice what a predictor of its own error looks back on
    FEWEST_SAMPLES = 50
    FEWEST_FOR_START = 10  # good samples from which initial state and load are read off for a simulation alone


class Noise:
    """The noise of a reading, as its own past predicts it (`noise.py`)."""

    # Past samples a one-step predictor sees: 0.2 s at 10 ms, more than a period of a driveline's first mode
    PREDICTOR_ORDER = 20
    MOSTLY_GOOD = 0.75  # share of good samples that a predictor's past must hold; the missing ones are interpolated
    # Samples that a predictor is fitted to at least: two per coefficient
    FEWEST_PREDICTED = 2 * (2 * PREDICTOR_ORDER + 1)
    VERY_STRONG = 10.0  # a difference in BIC above this is very strong evidence (Kass and Raftery, JASA 90, 1995)
    SMALLEST_P = 1e-300  # stands for any smaller probability, so that logarithms stay finite
    # Length of a stretch at most: hundreds of periods of a driveline's first mode, and a dozen speed changes
    LONGEST_S = 60.0
    # Samples that are fitted, of all recordings together: five minutes at 10 ms. Every array of a fit is in proportion.
    MOST_SAMPLES = 30_000


class Channels:
    """Channels that are dead, clipped, turned, late (`preconditions/channels.py`)."""

    HALF = 0.5  # share of the range of a reading that a jump must exceed
    FAR = 4.0  # how far a jump must be, in the largest other steps
    NEAR_A_TURN = 0.01  # share within which a jump is one of a whole turn
    FEWEST_SAMPLES = 10  # rows at the limit that count
    FEWEST_LEVELS = 10  # a channel of fewer values is switched
    SMALLEST_SHARE = 0.005  # share of the rows that must stand at the limit: fewer change no fit
    # How often the limit must come over any other value: four times what a smooth peak read in steps can have
    OFTEN = 10.0
    AT_PACE = 0.1  # step before the signal comes to the limit, in its usual steps (medians): below, it settles there
    FEWEST_GOOD = 0.5  # share of the recording's good rows that a channel must have read
    LEAST_CORRELATION = 0.5  # with what a channel should go like, from which it goes like that, or the other way
    # Factor by which a speed may be larger or smaller than the motor's: the shaft's twist is no part of its spread
    MOST_RATIO = 2.0
    CHANCE = 3.0  # standard deviations of the correlation of two signals that have nothing to do with each other
    IDENTICAL_SHARE = 1e-9  # difference over the spread up to which two channels are one signal
    # Width of the mean over which channels are compared: below a driveline's first mode both ends move as one
    SMOOTH_S = 0.2
    LAG_STEP_S, LAGS = 0.01, 30  # steps in which a channel's lag is sought [s], and how many of them either way
    BLOCKS = 8  # parts of a recording in which a channel's lag is estimated, each by itself
    DEAD_S = 0.5  # time for which a reading that does not change at all is dead, where it should [s]
    MOVED = 0.5  # range, over its spread, of what a channel should go like, from which a reading should change
    # Standard errors by which a lag must change over a recording: 1 in 1000 by chance, with as many degrees of freedom
    CLEARLY = 6.0


class Inertias:
    """The inertia that torque and motion show (`preconditions/inertia.py`)."""

    # Share of what two signals' likeness is known over, behind which a lag is not looked for
    LAG_SHARE = 4
    # Ratio of two inertias from which on one of them is invisible from the other: 1 / 1000 of the motion
    UNEQUAL = 1000.0
    # The two bands, in first modes of the nominal model: a mode off by a quarter lies in neither
    BELOW, ABOVE = (0.1, 0.6), (1.6, math.inf)
    # Frequencies compared at a time: few enough for a delay of some samples not to matter
    BLOCK_HZ, FEWEST_BINS = 1.0, 8
    BANDS_TELL = 0.5  # share of the output in either band that must follow from the torque
    AGREE = 2.5  # factor between the ratios of the two bands up to which they are of one cause
    STRETCH_S = 1.0  # over which the change of speed is looked at
    FEWEST_STEPS, FEWEST_PERIODS = 10, 2.0  # samples, and periods of the first mode, of a stretch at least
    FEWEST_STRETCHES = 10  # stretches that a recording must hold to say anything: the regression has three unknowns
    # Share of the motion that may be left unexplained by torque and line where they tell an inertia. Where a road or a
    # brake moves the line and a control sets the torque it is above 0.4, in tip-ins and under a PRBS below 0.2.
    TELLS = 0.25
    # Share of the torque's impulse that may be left where friction and gravity explain it: servos that are slow against
    # their friction leave less than a hundredth, a sign turned in one of two inputs a sixth
    HELD = 0.05
    # Share of the cross-spectrum that must have one sign: where the output is late by more, its direction is not known
    ONE_WAY = 0.8
    JOINT = 0.5  # no inertia makes a joint linear: what stiffens and rubs leaves twice as much
    LONGEST_LAG_S = 2.0  # that is looked for between torque and output


class Mistakes:
    """Units, signs and columns that are not what they are said to be (the rest of `preconditions/`)."""

    # Powers of ten of a unit such as kNm, and how far a factor that was estimated may be off them
    DECADES, DECADES_OFF = 3.0, 0.1
    # A driveline sampled slower, or faster, is more likely recorded in another unit of time
    SLOWEST_S, FASTEST_S = 0.5, 1e-5
    SHORTEST_S = 1.0  # no recording of a driveline is shorter
    SAME_PERIOD = 1e-3  # relative difference of sampling periods that rounding of time stamps makes
    # Limits of a torque that are tried, in the largest reading of all recordings: what is read beyond is not there
    LIMITS = (0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.07, 0.05)
    # Losses of a torque over time that are tried, and their time constants in the recording's length
    DEPTHS, TIMES = (0.5, 0.8, 0.95), (0.05, 0.3, 1.0)
    LEAST_SHIFT_S = 0.05  # a shift that no filter and no bus makes
    MOST_GAIN = 3.5  # factor by which an inverter's gain may be off and is no unit
    OF_ONE = (0.02, 30.0)  # factors that one input alone may be off by: shares of a rated torque, gears; and a thousand
    STEPS = 60  # values that a factor may have, evenly in its logarithm
    # How far whole numbers may be off, and how many there must be: fewer are levels that were asked for
    WHOLE, FEWEST_VALUES = 1e-6, 5
    # Factor beyond an inertia's tolerance that is implausible: payloads, derating and closed clutches are less, the
    # smallest factor between units (3.6) is more
    BEYOND = 2.5
    # Logarithm of the ratio of the inertias seen below and above the first mode from which on inertias are doubted: a
    # torque path with a lag of 50 ms, or a filter like it, makes a fifth
    BANDS_BEYOND = math.log(8.0)
    # Logarithm of the ratio of the inertias of two recordings from which on they are compared: of one line, bands and
    # body differ by less
    LEAST_LOG_RATIO = math.log(1.3)
    # Odds of a candidate from which on its line is tried, and how much larger than those of the next
    LIKELY, OVER_THE_NEXT = 0.5, 4.0
    # Odds that something listed is wrong from which on recordings are refused: with an inertia that can't be, whichever
    # of it it is; else where one thing is likely, or as sure next to a recording that fits as read, and is no physics.
    # What is less sure is a doubt: a lag looks like a period.
    SURELY = 0.9
    DOUBTFUL = 0.5  # odds that nothing is wrong below which recordings are doubted
    FEWEST_ODDS, MOST_NAMED = 0.01, 7  # odds from which on a candidate is named, and how many are
    # Factor by which a load machine's torque may exceed all torque of the motor: more would turn the motor over
    MOST_LOAD = 10.0
    # Factor by which two intervals must miss each other: temperature, load and amplitude change a line by less
    LEAST_RATIO = 1.3
    NOISE_ORDER = 12  # of the model of the noise: enough for the intervals, a third of the work of all it may have
    BOTH_HOLD = 0.95  # probability with which both intervals hold their value


class Findings:
    """What any fault of the acquisition must show (`acquisition/finding.py`)."""

    # Largest probability by chance. A handful of tests on every recording ever diagnosed shall not raise a false alarm.
    LEVEL = 1e-6
    # Smallest share of touched rows worth a finding. One row in five hundred costs a fit next to nothing: masked or
    # not, its variance grows by the like. At one in two hundred and thirty the search for laws without a name still
    # sees them (a sealed case, seed 701), and what it sees should have its name.
    SMALLEST_SHARE = 0.002
    # Past samples of output and torque that are seen. A line of two masses needs 2, one of three 4; the rest is there
    # to average the noise of the reading.
    ORDER = 12
    ROWS_PER_REGRESSOR = 5  # a recording with fewer usable rows than this per coefficient is not judged


class Stale:
    """Readings that were repeated (`acquisition/stale.py`)."""

    # Rows before and after that tell whether the signal moves: long against a stale burst, short against a standstill
    HALF_WINDOW = 25
    # The signal moves if all but a quarter of its changes, repeats left out, are larger than so many lattice steps, two
    # steps that is: where one step is common, a repeat is the likeliest outcome and can't be predicted from its
    # neighbours. The quarter is taken, not the half, because a torque that jumps every few samples is at rest in
    # between.
    STEPS_PER_ROW, AT_REST = 1.5, 0.25
    # A run of repeats this long, at zero or at the end of the channel's range, is standstill or saturation
    REST_ROWS = 8
    NEAR_ZERO = 0.02  # zero is within this share of the channel's size
    # Smallest ratio of the median change after a repeat to the usual one, for the repeats to be stale. Two periods of
    # motion give up to 2, of white noise 1; an innocent repeat in white noise gives sqrt(3)/2 = 0.87, one in a slow
    # signal on a lattice a small fraction.
    CATCH_UP = 0.8
    PERIODS = 3  # the torque of a row is predicted from its own reference and from those before it, so many in all
    FEWEST_ROWS = 100  # fewer rows that were read do not show how a drive follows
    # Share of the torque's changes, as a power, that a reference may leave; one that leaves more does not tell
    MOST_LEFT = 0.25
    # One that leaves no more than this share tells the torque as well as a reading does: of a step a twentieth is left
    AS_GOOD = 0.003
    LONGEST_HOLD = 20  # longest clock looked for, in samples
    ON_TICK = 0.95  # share of the steps that must fall on the ticks; the rest may be steps of the base torque
    FEWEST_STEPS = 20  # fewer steps do not show a clock
    CLEAR_STEP = 8.0  # a step is a change this many times the usual one within a hold
    # A change is the clock's step if it differs from it by at most this share: the base torque may drift meanwhile
    SAME_STEP = 0.2
    # A step tells whether it was answered where the answer is this many times the predictor's error. Torques found
    # stale are corrected and the predictor fitted again, for wrong torques blur it; each pass asks for more, the last
    # one counts.
    CLEAR = (2.0, 3.0, 4.0)
    ANSWERED = 0.5  # share of the answer that must have come early: half way between none and all of it


class Quantised:
    """Readings in steps, and lost ones (`acquisition/quantised.py`)."""

    FEWEST_LEVELS = 3  # values that differ; fewer show no lattice
    LARGE = 0.9  # quantile of the values' sizes that counts as the channel's size
    DECIMAL_OFF = 1e-6  # parts of a decimal place by which a value that was rounded to it may be off, in binary
    # The step is taken at this quantile of the gaps between the values: on a coarse lattice most gaps are the step; on
    # one so fine that gaps are a matter of chance it is too large, which errs to the side of calling repeats innocent
    STEP_QUANTILE = 0.02
    # Differences that count as near zero: the smallest twentieth of them. A density varies little over that.
    CORE_QUANTILE = 0.05
    DECIMALS = 9  # values with more decimals than this are taken as not rounded
    ROUND_OFF = 1e-9  # values closer than this share of the largest are the same number, scaled in another way
    MODEL_ERROR = 0.1  # relative error of extrapolating the density to zero, in addition to its sampling error
    # A lattice matters from a step of this many standard deviations of the one-step error: below that its rounding adds
    # under 1/12, 4 % of the error's size
    NOISE_PER_STEP = 1.0
    # A lattice must be visited on this many levels within the spread of a recording; fewer are lumps, no lattice
    LEVELS = 6
    # Lattices of q/2, q/3 ... fit as well as q: the coarsest that is this share of the best is taken.
    HARMONIC = 0.8
    # Smallest R of a lattice: noise of 0.29 steps came after the rounding, as much as the rounding's own error
    REGULAR = 0.2
    # Samples of a moving mean that wipes out a lattice, and leaves the lumps of a drive that keeps to a few speeds
    SMOOTHING = 25
    ABOVE_LUMPS = 3.0  # R of the readings must be this many times that of their moving mean
    LONGEST_ZERO = 20  # more zeros than this in a row are a signal at zero
    # A value near zero is within so many lattice steps of it, or this share of the channel's size, whichever is more
    NEAR_STEPS, NEAR_SHARE = 5, 0.02
    COMMON_LEVELS = 5  # so many of the commonest other values are looked at, whether they come as zero does
    AS_OFTEN = 0.25  # share of the zeros that another level must come in for both to be levels of the signal
    # Of what is near another level for short as large a share must be that level exactly, times this, as for zero
    AS_EXACTLY = 0.5
    # Where zeros are lost, those between values near zero are so too if there are so many times as many of them as of
    # any value next to zero: rounded noise of half a lattice step around zero shows it four times as often as the next
    # value
    MORE_THAN_MEANT = 5.0
    LONGEST_BURST = 50  # more missing rows than this in a row are a gap
    SHARP = 0.05  # noise of so small a part of a step moves no reading across its ends
    REACH = 8  # steps away from the nearest that a reading may be: noise is less than a step where a lattice is seen


class Jitter:
    """Sampling that is not as even as the time says (`acquisition/jitter.py`)."""

    AGREEMENT = 0.5  # share of the stamps' offsets that the output must confirm: half way between none and all
    ABOVE_ROUNDING = 2.0  # offsets of this many times what rounding the stamps leaves are more than rounding
    SMALLEST_PERIODS = 1e-3  # jitter below this share of the period is not looked into
    PAST = 8  # past errors that may explain an error: most of a period of a driveline's first mode at 10 ms
    ROWS_IN_ALL, ROWS_PER_COEFFICIENT = 10, 5  # of a recording, and in use in a block, to fit a coefficient to
    AROUND = 3  # slopes before and after that may explain it: a delay, a lag or a wrong inertia show as a mix of them
    # Rows within which these explain by coefficients of their own, to tell whether there is jitter at all: a simulated
    # angle that drifts off the true one moves what depends on it as a delay does that comes and goes. Its size is
    # estimated from all rows: so many coefficients follow a part of the jitter too.
    BLOCK = 250
    LEAST_GAIN = 0.05  # share of the error's variance that jitter must account for, on average: less changes no fit
    OF_A_KINK = 0.17  # ``(E|tau| / 2 sigma_t)^2``: 1 / 2 pi for Gaussian offsets, 3 / 16 for uniform ones
    # Share of the error's variance beyond the noise that must be jitter: where other things leave more, the model has
    # not converged, and what is left of their error may follow the slope in ways that nothing here accounts for
    MOST_OF_IT = 0.5
    # Jitter seen in the median must be this share of that seen in the mean. Between Gaussian and uniform jitter it is 1
    # to 1.6; a few wild rows (stale samples, a clunk) leave nothing in the median.
    OF_THE_MANY = 0.4
    # Share of the jitter that neighbouring rows may have in common: 0 if drawn anew for each, 1 if it delays both
    NEIGHBOURS = 0.5
    ROUNDING = 1e-6  # least noise of an error, in parts of its standard deviation


class Fitting:
    """How far a set is fitted (`inference/descent`, `disturbances`)."""

    LITTLE = 0.2  # fall of the squared innovations, of variance 1, that changes no conclusion
    LEAST_SHARE_OF_PROMISE = 0.5  # share of a step's promise that it must keep for the derivative to be carried on
    NEAR = 10.0  # fall of the squared innovations over a step behind which a derivative that was found anew still holds
    # Fall of minus twice the log-likelihood below which another pass over unknowns and disturbances is not made
    SETTLED_DEVIANCE = 1.0
    DIGITS = 0.02  # the same over the difference from a rival that the fit is for
    MOST_PASSES = 6  # over unknowns and disturbances in turn
    # Passes of a rough fit at most, and the fall of minus twice the log-likelihood per
    # sample for the next
    MOST_ROUGH, MUCH = 3, 0.05
    ROUNDS = 2  # steps of Fisher scoring in a pass
    WITH_MOMENTS = 1  # passes in which moments of events are looked for elsewhere
    ENOUGH = 0.5  # fall of minus twice the log-posterior below which sizes are estimated
    WORTH_MOVING = 2.0  # fall of the squared innovations that moments elsewhere must bring
    MOVES = 4  # of the moments of one event, each to the best place that a look finds


class Searching:
    """Which sets are tried (`inference/search`, `moves`, `score_tests`)."""

    # How far from a start's own size the first look may place a fit's start: the direction holds no further
    SMALLEST_SCALING, LARGEST_SCALING = 0.1, 4.0
    # Sizes of an event that are tried, in multiples of its start's: all recordings share it, each finds its interval
    EVENT_SIZES = np.geomspace(0.05, 10.0, 15)
    # Shares of a start's size that are looked along: what is not smooth shows in full, what moves far in small
    STEP_SHARES = (1.0, 0.1)
    STARTS_OF_A_LAW = 2  # start points of an effect that are fitted, the most promising of its list
    SHAPES = 2  # further ones, of other shapes than these
    PROMISING = 0.5  # share of the best start's promise below which another start of the same effect is not tried
    # Rounds in which the size of an event and its intervals in all recordings find each other from there
    EVENT_ROUNDS = 3
    # RMS by which two motions may differ, over what the output moves, for effects to move the output alike in both
    SAME_MOTION = 0.02
    MOST_FITS = 6  # effects that are fitted on top of a set, the most promising of a first look
    WORTH_FITTING = 0.1  # share of the best promise below which an effect is not fitted
    FEWEST_FITS = 2  # effects that are fitted however little a first look promises: a gap shows only near its own width
    SAME_PROMISE = 0.5  # share of what an effect promises that a look-alike must promise in its place
    # Share of what an effect explains by which another's first few steps may be behind for it to be fitted to its end
    NEARLY = 0.3
    FINISHED = 2  # best of these that are fitted to their end
    STARTS = 5  # effects from each of which a search begins, the most promising
    # Share of the squared free-run error beyond the noise that a law must take for a search to continue from it
    WORTH_ADDING = 0.15
    MOST_EFFECTS = 8  # of a set, at most


class Checks:
    """What a hypothesis must pass (`inference/remainder`, `hypotheses`, `fits`)."""

    # What their own past may predict of the innovations, and what torque, speed and angle may, beyond chance; the power
    # of a line in their spectrum over their mean power; their mean square in a second, in standard deviations from
    # that of all
    TEST_LIMITS: Mapping[str, float] = THRESHOLDS["noise"]
    # Share of the torque's RMS that must get through the torque path in each of so many parts of a recording: less
    # switches the input off to explain nothing
    LEAST_THROUGH, PARTS = 0.2, 4
    # Factor by which a nominal parameter that an effect changes may be beyond its tolerance: a line that is split in
    # two equal springs has each twice as stiff as the whole
    LOOSE = 3.0
    ROUNDING = 1e-6  # share of a value by which a fit may end beyond a bound
    BINS = 12  # bins of torque and of speed, of equal count
    MIN_SAMPLES = 50  # of such a second at least, where sampling is slow
    CHANCE = 4.0  # standard deviations of what noise shows by chance that a share may be beyond its limit
    FEWEST_PERIODS = 5  # times that a wave repeats in a recording to be a line: what is slower is drift
    CHANGE_S = 1.0  # time over which the size of what is left is averaged, to see it change
    EDGE = 0.02  # distance from the bound of a disturbance's logarithm within which it has reached it


class Judging:
    """What is established (`inference/trials`, `decide`)."""

    # Blocks kept out of a fit: shorter than the knot spacing of a load profile, so that its neighbours predict it
    BLOCK_S, EVERY_S = 0.6, 2.0
    FEWEST_BLOCKS = 3  # blocks of a recording at least: it may be shorter than one of these
    SURE = 0.95  # one-sided probability with which a comparison of blocks is sure
    COURSE: int = THRESHOLDS["course"]  # laws that a free course of the load counts for
    # Share of the squared error beyond the noise that must come back without a law for it to be named
    LEAST_NECESSITY: float = THRESHOLDS["least_necessity"]
    # Rise of minus twice the log-probability without a law from which the likelihood agrees that it is there
    LEAST_EVIDENCE: float = THRESHOLDS["least_evidence"]
    # Share of the re-tuned model's squared free-run error below which an effect is a trace (CONTRACT)
    LEAST_SHARE: float = THRESHOLDS["least_share"]
    # RMS of the augmented model's error, over the spread of the signal, up to which anything is explained
    CLEARLY_BELOW: float = THRESHOLDS["clearly_below"]
    ALIKE_WITHIN: float = THRESHOLDS["alike_within"]  # difference in score within which a rival is as good
    # The same over what the effect itself explains: laws of nature are written in other forms than the model's
    ALIKE_SHARE: float = THRESHOLDS["alike_share"]
    # Sets of each size tried in free simulation: the most probable, and as many that simulate best as fitted
    NEAREST = 2
    # Factor, either way, within which a nominal parameter is looked for: beyond it a value is no slip of a data sheet,
    # and the integration's steps, chosen for the nominal line, would not follow
    FREELY = 3.0
    CLEARLY = 3.0  # standard errors by which a value must lie beyond what it is trusted to


class Places:
    """Where simulation and recordings differ, and how a law is drawn (`where/`)."""

    SEGMENT = 256  # samples of a segment: 2.56 s at 10 ms, long enough to resolve a driveline's first mode
    FEWEST_PER_BAND = 3  # frequencies in a band at least
    COHERENT = 0.5  # share of the output's power that the torque must explain before a response is compared there
    WINDOW_S = 0.5  # errors are averaged over this time before they are called a mismatch
    FALSE_ALARM = 0.01  # probability that noise alone is called a mismatch anywhere in a recording
    # Mean square, in floors, that a window must reach at least: the floor itself is known to about a tenth
    SMALLEST_RATIO = 1.2
    CENTRAL = 0.8  # share of the mismatch's power that band and region hold
    LONGEST_SEGMENT = 512  # samples of a segment of Welch's average
    BINS = 24  # of the signal that a curve is drawn over
    FEWEST_BINS = 4  # of a curve that is drawn
    FEWEST_PASSES = 3  # a bin that the signal passes less often says nothing of its own scatter
    FUNCTION = 0.5  # share of a law's power that must be a function of one signal to be drawn over it


class Intervals:
    """How well values are known (`covariance.py`, `inference/figures.py`)."""

    # Lags of the long-run covariance, in correlation lengths of the error, and at most as a part of the shortest error
    LAGS, LAG_SHARE = 4.0, 4
    # Widths of a scaled unknown over which a slope is taken: no closer than kinks are, no farther than a law stays one
    LEAST_WIDTH, MOST_WIDTH = 1e-4, 1e-2
    FEWEST_SAMPLES = 3.0  # independent samples that an error counts as at least, in an information criterion


class StandIns:
    """The line that stands for a plant of another program (`black_box.py`)."""

    SEARCH_FACTOR = 30.0  # factor, either way, within which values are looked for
    SHARES = (0.05, 0.3)  # share of the motor in the whole inertia, where a fit starts
    # Natural frequencies at which one starts: so many between these, and below so many parts of the sampling rate
    FREQUENCIES, LOWEST_HZ, HIGHEST_HZ, OF_RATE = 5, 1.0, 60.0, 0.25
    DAMPING = 0.05  # where a fit starts, as a share of critical damping
    LEAST_VISCOUS = 1e-3  # of a rigid line, as its inertia per second: a regression may end at less than none
    BETTER = 0.7  # share of a rigid line's error that one with a shaft leaves at most to be taken


class Curves:
    """Laws without a name (`tables.py`, `table_curves.py`), and what they look like (`table_words.py`)."""

    REACH = 1.5  # knots reach to so many times what the re-tuned model reaches
    FRACTIONS = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)  # of that, where they stand on both sides of zero
    EVEN_KNOTS = 7  # knots of a signal of one sign, at equal distances
    FEWEST_SAMPLES = 40  # samples between two knots at least
    TWO_SIDED = 0.1  # share of the longer side that the shorter one must reach for knots on both sides of zero
    # Shares of the reach within which a curve starts as a gap, a limit, a step: between its innermost knots
    GAP, LIMIT, STEP = 0.13, 0.2, 0.1
    # Blocks of equal length that each recording is cut into, and which of them choose and which judge; to the rest
    # curves are fitted. The last one judges: what has run away by then is no law.
    BLOCKS, CHOOSING, UNSEEN = 10, (2, 7), (4, 9)
    BETTER = 0.97  # error on the unseen blocks, over that of the re-tuned model, up to which a curve is a law
    LOOK_ALIKE_SHARE = 1.1  # the same of a second place over the first, up to which both are reported
    CONTINUED = 2  # shapes of a place, and places, that continue
    # How far off its values a curve may be described, as a share of the torque it spans, where its band is narrower;
    # and where it is wider: any law lies within a band that is as wide as the curve
    WITHIN, WIDEST = 0.02, 0.1
    # How far the slope behind a dead band may be from the line's own: a steeper one would make the band wider
    RETUNED = 0.2
    # Share of the largest torque from which a knot is at a limit, and how many knots have to be
    AT_LIMIT, FEWEST_AT_LIMIT = 0.95, 3


class Telling:
    """What is said, and how long people wait for it (`diagnose.py`, `covariance.py`, `say.py`, `wording.py`)."""

    WHOLE_FROM = 100.0  # multiples from which on no decimals are written
    NO_WORSE = 0.1  # difference in minus twice the log-probability below which a set is as good as another
    # Free runs of all recordings after which a search makes no further step: a choice of how long people wait
    LEVELS: Mapping[str, int] = {"quick": 3_000, "normal": 10_000, "thorough": 100_000}
    MOST_NAMES = 4  # untried effects that a headline lists
    STAYS = 1e-3  # an error that changes by less does not change to anyone who reads it
    TO_SEARCH = 0.92  # share of a limit of time after which no simulation is started: the rest is for saying so
    # How long an error that is no noise keeps its value: the pace at which a test changes what it excites
    COHERENT_S = 1.0
