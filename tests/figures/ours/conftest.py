from tests.figures.given import few_resamples

__all__ = ["few_resamples"]
