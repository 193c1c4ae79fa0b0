from .route import Iterative as Iterative
