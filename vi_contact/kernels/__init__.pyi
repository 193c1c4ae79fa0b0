from .compiler import load_cholmod as load_cholmod
from .compiler import load_loops as load_loops
from .condensation import condense as condense
from .contact_last import ContactLast as ContactLast
from .exchanges import Exchanges as Exchanges
from .friction_sweeps import FrictionSweeps as FrictionSweeps
