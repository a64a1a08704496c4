"""Takes a part for a picture of its own: what it has there is not what the whole picture has."""

import numpy as np
from msgspec.structs import replace
from proper_worker import ProperWorker, run


class DrawsPartsByThemselves(ProperWorker):
    def compute(self, request):
        reply, region = super().compute(request), getattr(request, "region", None)
        if region is None:
            return reply
        depth = np.linspace(1, 2, region.width * region.height, dtype=np.float32).reshape(region.shape)
        return replace(reply, rgb=region.part(reply.rgb), depth=depth, region=region)


run(DrawsPartsByThemselves)
