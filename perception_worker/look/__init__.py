"""What of a picture the network is shown, and whose skeleton of those that it sees is taken.

`looks.py` has the two ways: the whole frame, or the region where the filter expects the person, or begins to look.
`expectation.py` is what the filter expects in the picture, `region.py` the rectangle that shows a person, `sight.py`
what one look came to, and `pictures.py` where pictures and parts of them come from.
"""

from perception_worker.look.looks import Look, TrackingLook, WholeLook
from perception_worker.look.pictures import HeldPictures, Pictures
from perception_worker.look.sight import Sight

__all__ = ["HeldPictures", "Look", "Pictures", "Sight", "TrackingLook", "WholeLook"]
