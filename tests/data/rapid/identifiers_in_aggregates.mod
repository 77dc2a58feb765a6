MODULE Aggregates
  CONST robtarget p1:=[[x,y+1,-z],orient1,conf,[9E9,extax.eax_b,9E9,9E9,9E9,9E9]];
  PERS tooldata t1:=[TRUE,[[0,0,1.5E-05],[1,0,0,0]],[-1,[0,0,0],[1,0,0,0],0,0,0]];
  PERS wobjdata w1:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  VAR robtarget zero:=[[0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,0,0,0]];
  VAR num empty{2}:=[[],[]];
  VAR pos signs{2}:=[[- 1,+2,-.5],[-1.,(3),-(4)]];
  VAR num long{3}:=[a,[1,2,3],[4,[5,"six",TRUE],b]];
ENDMODULE
