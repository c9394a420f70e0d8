"""What decides in naming and in how far a name is trusted: every margin with its reason.

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
