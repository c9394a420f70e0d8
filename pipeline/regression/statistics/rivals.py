"""How large what is not told could be: a name stands only where the log excludes its rivals.

That a richer law predicts no better is no evidence against it where the log could not tell: a name
needs that what would make it another one is known to be small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.regression.statistics.gram import Key
from pipeline.regression.statistics.solve import Fit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Added:
    """What each of some columns would be if it alone were added to those that are told.

    Attributes:
        size: (R,).
        error: Its standard error, (R,).
        moves: By which it would change the size of those that are told, (R, K).
    """

    size: Array
    error: Array
    moves: Array


def added(fit: Fit, weight: Array, keys: Sequence[Key], rivals: Sequence[Key]) -> Added:
    """Every rival by itself.

    With the curvature of the fit G, a column u added to those that are told, K, has

        s = G_uu - G_uK G_KK^-1 G_Ku,   x = (m_u - G_uK G_KK^-1 m_K) / s,   var x = 1 / s

    and x_K changes by -G_KK^-1 G_Ku x (block inversion); s is no less than what is known of u
    beforehand.

    Args:
        fit: Regressions.
        weight: How often every block counts, (B,).
        keys: Columns that are told, free bodies beside them.
        rivals: Columns that are not.
    """
    at = fit.columns([*keys, *rivals])
    k = len(at) - len(rivals)
    gram, moment = fit.normal(weight, at)
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    gram, moment = gram / np.outer(scale, scale), moment / scale
    inner = np.linalg.pinv(gram[:k, :k], rcond=1e-12, hermitian=True)
    across = gram[k:, :k] @ inner
    left = np.diag(gram)[k:] - np.einsum("uk,uk->u", across, gram[k:, :k])
    left = np.maximum(left, 1e-12)
    size = (moment[k:] - across @ moment[:k]) / left
    first = k - len(keys)
    moves = -across[:, first:] * size[:, None] / scale[first:k]
    return Added(size / scale[k:], 1.0 / np.sqrt(left) / scale[k:], moves)
