"""The decision of one robot: inputs as tables, policy, fallbacks where nothing is safe, and outcome."""

from slalom.decision.decision import Decision, Outcome
from slalom.decision.inputs import Commitment, DecisionInputs

__all__ = ["Commitment", "Decision", "DecisionInputs", "Outcome"]
