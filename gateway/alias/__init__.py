"""``import springscale``: the package under the name that its command and its distribution have.

The same objects as those of ``gateway``, each imported when it is first asked for (docs/api.md).
"""

from gateway import __all__ as __all__
from gateway import __dir__ as __dir__
from gateway import __getattr__ as __getattr__
