"""The learners and their networks: SAC and recurrent PPO, and the policies that they are compared with."""
