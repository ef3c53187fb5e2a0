from tests.benchmarks.paper.given import few_resamples

__all__ = ["few_resamples"]
