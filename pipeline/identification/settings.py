"""What decides in `gap`, what is named and how far a name is trusted: every margin with its reason.

`answer.identify` puts the level (`confirmed`, `approximate`, `suspected`) together by them.
"""

from __future__ import annotations

from typing import Final

#: Chunks of all logs together. A chunk is left out at a time: so many are enough for a standard
#: error over them (15 degrees of freedom) and few enough that each is longer than the residual's
#: memory.
CHUNKS: Final = 16
#: Evidence that a name has to bring beyond even odds of all names (logarithm): "strong" (Kass and
#: Raftery, JASA 90, 1995: 2 ln B = 6).
MARGIN: Final = 3.0
#: What comes nearer than this keeps a name from being confirmed, and what is likelier by as much
#: stands in its place (logarithm): odds of 150.
EXCLUDED: Final = 5.0
#: Standard errors over left-out chunks by which a name has to predict better than nothing, and than
#: a rival: two, as in a 95 % interval.
SURE: Final = 2.0
#: Standard errors in half of a 95 % interval.
COVER: Final = 1.96
#: Share of the squared residual at its own joints, left-out chunks, that a name has to take: below
#: it lies what laws that hold to some per cent leave of each other.
SHARE: Final = 0.01
#: Prior scale of a link's body that the search may only pass by a name's margin: the tolerance of a
#: part that was made to its drawing.
TIGHT: Final = 0.003
#: Largest scale of a body: mass and second moments by a factor of e^.5. Wider scales were never
#: informed by a log and moved what no motion shows.
LOOSE: Final = 0.5
#: Longest change of a body's coordinates before its columns are made anew.
STEP: Final = 0.7
#: Share to which a law of friction or transmission holds at best, in every interval.
LAW: Final = 0.01
#: What a model leaves over the floor, in any channel, that counts as unexplained.
UNEXPLAINED: Final = 1.6
#: The same where what is left depends on nothing in the log: the floor is measured above the band,
#: and noise with a memory of some periods of the cut-off is up to so many times larger in it.
COLOURED: Final = 3.0
#: Logarithm of odds by which a rival may fit worse and is a twin still: what is between the two are
#: sizes in practice, which no log tells.
TWIN: Final = 3.0

# Of the search (`search.py`).

#: Share of the foremost move's foreseen gain, or of that of the name it would replace, below which
#: a move is not estimated: both are foreseen on one noise, which estimates change alike.
FORESEES: Final = 0.5
#: Rise of the evidence that is none.
NO_RISE: Final = 0.01
#: ... and below which what stands is not exchanged: "not worth more than a bare mention" (Kass and
#: Raftery, JASA 90, 1995: 2 ln B = 2).
BARE: Final = 1.0
#: Share of what estimates promise by which a model with them may fall short of it.
STRAIGHT: Final = 0.1
#: Small steps of a coordinate beyond which a prediction that is not linear in it has bent.
BENT: Final = 20.0

# Of the answer (`answer.py`).

#: Share of a name's torque from which on another's columns may be a twin's, made anew.
SHARED: Final = 0.9
#: Evidence that columns about where a rival lies may still bring it (logarithm).
FAR_BEHIND: Final = 200.0
#: Names that may stand in the place of one, so that a class has three members.
LARGEST_CLASS: Final = 2

# Of what files and earlier logs leave open (`offered.py`).

#: Of a winding and of friction, where their files state no wider interval [1].
RESISTANCE: Final = 0.02
STATED_FRICTION: Final = 0.005
#: What a log left open at most of friction and bodies that it showed [1]: what moves further is
#: told, or a thing that was mounted would be shared out over links that the first log left open.
STATED_MOST: Final = 0.05
BODY_MOST: Final = 0.01

# Of the gap by joint and what is left (`residual.py`).

#: Fewer rows in a band say nothing.
FEWEST_ROWS: Final = 20
#: Share of the remaining variance that a variable's curve explains, to be worth a word.
TELLING: Final = 0.08

# Of two positions of a joint (`two_positions.py`).

#: Torque over which a joint passes from one flank to the other, of the largest seen [1].
CROSSING: Final = 0.05
#: Standard deviations from which a slope or a step counts as seen.
SEEN: Final = 4.0
#: Torques below this many standard deviations do not tell their sign.
SURE_SIGN: Final = 3.0
#: ... nor below this share of its root mean square, which friction may be.
FRICTION_SHARE: Final = 0.25
#: Fewer rows with a sure sign tell neither spring nor play.
LEAST_ROWS: Final = 60
#: Share of what a filter sees that must have the torque's sign.
ONE_SIDE: Final = 0.98

# Of columns that are not what they say (`wrong_columns.py`).

#: Share of an effort, root mean square, that honest machines leave: nothing more is asked, and what
#: leaves more is looked at. Of a leg in the air it is a share of all that its joint gives.
FLOOR: Final = 0.1
#: Share that may be left where a reading is to explain an effort, and that has to be left for any
#: look where only the lowest feet tell which stand ...
WELL: Final = 0.5
#: ... and share of what was left before: 22 in place of 24 % is no reason to accuse a column.
HALVED: Final = 0.5
#: Where as much is left in the middle of the joints by any reading, nothing follows the motion ...
LOST: Final = 0.75
#: ... nor where as much is, and efforts that are shifted in time are explained as well as in place,
#: or with springs, too, several joints are not explained.
LEFT: Final = 0.2
#: So many shifts are tried, of which one in twenty may explain as well by chance.
SHIFTS, CHANCE = 20, 0.05
#: Share of the largest gain within which readings count as alike: the simplest is taken.
ALIKE: Final = 0.8
#: Share of what friction alone leaves that bodies as given, of any size, have to bring it below.
TOLD: Final = 0.7
#: Factor on an effort that bodies may be wrong by: a URDF's masses are guesses at times.
BODIES: Final = 2.5
#: ... and from which none of a robot's files is that wrong, unit or not.
FAR: Final = 5.0
#: Distance from a unit or a ratio within which an odd factor is taken for it.
NEAR: Final = 1.4
#: ... and for factors so small that bodies may be them: only where all joints agree within this.
EXACT: Final = 0.01
#: Fewer rows accuse no column.
FEWEST_COMPARED: Final = 60

# Of power at the supply (`supply/`).

#: Share of the root mean square error by which a term has to improve a prediction: where a motion
#: repeats, so do the model's own errors, and what is no better in truth is a little better in every
#: block. Nothing is improved below a share of the power that no meter at a supply tells from zero.
LITTLE: Final = 0.05
METER: Final = 1e-3
#: Share of the power's variance that a sum may leave which the power is said to follow.
FOLLOWS: Final = 0.5
#: Fewest samples from which terms can be separated and tested.
FEWEST_SAMPLES: Final = 24
#: Part of the measured power below which what stays unexplained is no finding.
SMALL: Final = 0.02
